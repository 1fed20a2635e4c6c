//! What the system's libraries print on our standard error, and how not to let them.

/// Keeps Mesa's Vulkan layer for device selection from looking for a Wayland display, which it does by way of a library that complains on standard error (twice for
/// every look) where `XDG_RUNTIME_DIR` does not name a folder, as in most containers. The layer listens to `NODEVICE_SELECT`, and only before it is loaded: the
/// program starts itself anew with that variable, in the same process. Which device is used does not depend on the layer, since adapters are ranked here.
#[cfg(target_os = "linux")]
pub fn silence_device_selection() {
    use std::os::unix::process::CommandExt;
    const SWITCH: &str = "NODEVICE_SELECT";
    let runtime = std::env::var_os("XDG_RUNTIME_DIR").is_some_and(|folder| std::path::Path::new(&folder).is_dir());
    if runtime || std::env::var_os(SWITCH).is_some() {
        return;
    }
    let mut arguments = std::env::args_os();
    let (Ok(program), Some(name)) = (std::env::current_exe(), arguments.next()) else { return };
    // It comes back only if it could not start; the complaint is then the lesser evil.
    let _ = std::process::Command::new(program).arg0(name).args(arguments).env(SWITCH, "1").exec();
}

/// Nothing to silence here.
#[cfg(not(target_os = "linux"))]
pub fn silence_device_selection() {}
