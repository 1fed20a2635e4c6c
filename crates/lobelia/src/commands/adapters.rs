use crate::failure::Failure;
use lobelia::graph::{Gpu, GpuError};
use std::io::Write;

/// List the devices that could be used, the best first.
#[derive(clap::Args, Clone, Debug)]
pub struct Arguments {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let adapters = Gpu::adapters();
    if adapters.is_empty() {
        return Err(GpuError::NoAdapter { wanted: None }.into());
    }
    let mut out = std::io::stdout().lock();
    if arguments.json {
        let list: Vec<_> = adapters
            .iter()
            .map(|info| {
                serde_json::json!({
                    "name": info.name,
                    "backend": info.backend.to_string(),
                    "kind": format!("{:?}", info.device_type),
                    "driver": format!("{} {}", info.driver, info.driver_info),
                })
            })
            .collect();
        writeln!(out, "{}", serde_json::Value::from(list))?;
    } else {
        for info in adapters {
            writeln!(out, "{} ({}, {:?}; {} {})", info.name, info.backend, info.device_type, info.driver, info.driver_info)?;
        }
    }
    Ok(())
}
