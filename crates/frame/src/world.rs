use lobelia_graph::World;
use lobelia_scene::{LightTransport, SceneTraits, device::GpuScene};

/// The world that the built-in passes run on: a scene of `lobelia-scene`.
pub struct SceneWorld;

impl World for SceneWorld {
    type Traits = SceneTraits;
    type Device = GpuScene;
    /// Which light, after how many scattering events.
    type Claim = LightTransport;

    fn unspecialised(traits: &SceneTraits) -> SceneTraits {
        traits.unspecialised()
    }

    fn pre_exposure(device: &GpuScene) -> f32 {
        device.pre_exposure()
    }
}
