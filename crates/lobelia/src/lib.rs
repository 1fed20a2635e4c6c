//! Lobelia's facade: every built-in pass in one registry, and the [`Session`] that loads a scene, plans a graph and renders it.
//!
//! ```no_run
//! use lobelia::{Session, SessionOptions, Shot};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let graph = lobelia::graph::GraphFile::load("graphs/indirect.ron".as_ref())?;
//! let mut session = Session::new("builtin:cornell-glossy", &SessionOptions::default())?;
//! let wired = graph.wire(&lobelia::registry(), &["vpl".into()], &[])?;
//! let shot = Shot { extent: [240, 240], ..Shot::default() };
//! let mut render = session.start(&wired, &shot)?;
//! let picture = render.run(&mut |_| true)?;
//! println!("{:?}", picture.pixels[0]);
//! # Ok(()) }
//! ```

pub use lobelia_aism as aism;
pub use lobelia_arealight_ltc_free as arealight_ltc_free;
pub use lobelia_arealight_peers as arealight_peers;
pub use lobelia_brsm as brsm;
pub use lobelia_compose as compose;
pub use lobelia_direct as direct;
pub use lobelia_frame as frame;
pub use lobelia_gbuffer as gbuffer;
pub use lobelia_graph as graph;
pub use lobelia_lobes as lobes;
pub use lobelia_measure as measure;
pub use lobelia_progressive as progressive;
pub use lobelia_reference as reference;
pub use lobelia_report as report;
pub use lobelia_rsm as rsm;
pub use lobelia_scene as scene;
pub use lobelia_shaders as shaders;
pub use lobelia_visibility as visibility;
pub use lobelia_vpl as vpl;
pub use lobelia_vsgl as vsgl;
pub use lobelia_vsl as vsl;

pub mod comparison;
pub mod explain;
pub mod exposure;
pub mod layers;
pub mod light;
mod session;
pub mod sweep;
pub mod trial;
pub mod truth;
pub mod variants;

pub use session::{MAX_SIDE, Picture, Rendering, Session, SessionError, SessionOptions, Shot, Step, frame_time};

use lobelia_frame::SceneWorld;
use lobelia_graph::Registry;

/// Every built-in pass, listed one crate at a time: no link-time magic. A host adds its own passes to what this returns.
pub fn registry() -> Registry<SceneWorld> {
    let mut registry = Registry::new();
    lobelia_gbuffer::register(&mut registry);
    lobelia_rsm::register(&mut registry);
    lobelia_brsm::register(&mut registry);
    lobelia_direct::register(&mut registry);
    lobelia_arealight_ltc_free::register(&mut registry);
    lobelia_arealight_peers::register(&mut registry);
    lobelia_vpl::register(&mut registry);
    lobelia_vsgl::register(&mut registry);
    lobelia_vsl::register(&mut registry);
    lobelia_visibility::register(&mut registry);
    lobelia_aism::register(&mut registry);
    lobelia_compose::register(&mut registry);
    lobelia_progressive::register(&mut registry);
    registry
}
