//! What the pipeline tests share: the reference images, where they are present, and rendering in one call.

pub mod untrusted;

use lobelia::{Session, Shot, graph::GraphFile, measure::Image, scene::Ndf};
use std::{
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

/// Root of the workspace.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_owned()
}

/// The folder of large optional material (scenes, reference images): `LOBELIA_SHARED`, or `shared` beside the workspace. Says so if it is absent.
pub fn shared() -> Option<PathBuf> {
    let folder = std::env::var_os("LOBELIA_SHARED").map_or_else(|| root().join("../shared"), PathBuf::from);
    if folder.join("reference").is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: reference images are not here (set LOBELIA_SHARED)");
    None
}

/// The program, built once.
///
/// # Panics
/// If it cannot be built.
pub fn program() -> &'static Path {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let built = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "-p", "lobelia-lobelia", "--bin", "lobelia"])
            .current_dir(root())
            .status();
        assert!(built.is_ok_and(|status| status.success()), "the program cannot be built");
        // Beside the folder of this test.
        let own = std::env::current_exe().unwrap_or_default();
        let folder = own.parent().and_then(Path::parent).unwrap_or(Path::new("."));
        folder.join(format!("lobelia{}", std::env::consts::EXE_SUFFIX))
    })
}

/// The device, or a word that the test is skipped.
pub fn has_gpu() -> bool {
    lobelia::graph::testing::gpu().is_some()
}

/// A scene rendered through a graph of `graphs/`.
pub struct Render<'a> {
    /// File in `graphs/`.
    pub graph: &'a str,
    /// Scene address.
    pub scene: &'a str,
    /// Variants.
    pub variants: &'a [&'a str],
    /// `pass.param=value`.
    pub set: &'a [&'a str],
    /// Normal distribution function.
    pub ndf: Ndf,
    /// The rest.
    pub shot: Shot,
}

impl Render<'_> {
    /// Renders, and brings back the named radiance.
    pub fn radiance(&self, name: &str) -> Result<Image, String> {
        let graph = GraphFile::load(&root().join("graphs").join(self.graph)).map_err(|error| error.to_string())?;
        let variants: Vec<String> = self.variants.iter().map(|variant| (*variant).to_owned()).collect();
        let overrides = self.set.iter().map(|text| text.parse()).collect::<Result<Vec<_>, String>>()?;
        let wired = graph.wire(&lobelia::registry(), &variants, &overrides).map_err(|error| error.to_string())?;
        let mut scene = lobelia::scene::Scene::load(self.scene).map_err(|error| error.to_string())?;
        scene.ndf = self.ndf;
        let gpu =
            lobelia::graph::Gpu::new(&lobelia::graph::GpuOptions { adapter: None, baseline: true }).map_err(|error| error.to_string())?;
        let mut session = Session::with(gpu, scene, 0.0).map_err(|error| error.to_string())?;
        let mut shot = self.shot.clone();
        shot.keep.push(name.to_owned());
        let mut rendering = session.start(&wired, &shot).map_err(|error| error.to_string())?;
        rendering.run(&mut |_| true).map_err(|error| error.to_string())?;
        rendering.radiance(name).map_err(|error| error.to_string())
    }
}
