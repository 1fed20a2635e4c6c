//! The typed resources that passes exchange, named for what they mean.
//!
//! Each type states space and unit, says which parts it has for which shape, and has one WGSL accessor module in `shaders/` that is the only place where
//! its texels are decoded:
//!
//! | resource | accessor module |
//! | --- | --- |
//! | [`GBuffer`] | `lobelia::surface`, `lobelia::scene` |
//! | [`ReflectiveShadowMap`] | `lobelia::reflective_shadow_map`, `lobelia::surface` |
//! | [`VirtualLights`] | `lobelia::virtual_lights` |
//! | [`PatchMoments`] | `lobelia::patch_moments` |
//! | [`SamplingDensity`] | `lobelia::sampling_density` |
//! | [`LightVisibility`] | `lobelia::light_visibility` |
//!
//! *Scene space* is world space minus the scene's whole-metre origin, in metres, so that 32-bit floats keep their precision far from the world's origin.

mod area_light_visibility;
mod axis;
mod gathered_sums;
mod gbuffer;
mod light;
mod patch_moments;
mod radiance;
mod reflective_shadow_map;
mod sampling_density;
mod world;

pub use area_light_visibility::{AreaLightVisibility, AreaLightVisibilityShape};
pub use axis::Axis;
pub use gathered_sums::GatheredSums;
pub use gbuffer::{GBuffer, GBufferShape, SurfaceFlags, SurfaceFormats};
pub use light::{LightVisibility, LightVisibilityShape, VirtualLight, VirtualLightLobes, VirtualLights, VirtualLightsShape};
pub use lobelia_scene::{LightClass, LightTransport};
pub use patch_moments::{LobeLength, PatchMoments, PatchMomentsShape};
pub use radiance::{DisplayImage, ImageShape, Radiance};
pub use reflective_shadow_map::{MAX_LAYERS, ReflectiveShadowMap, ReflectiveShadowMapShape, RsmFace};
pub use sampling_density::{SamplingDensity, SamplingDensityBindings, SamplingDensityLevels, SamplingDensityShape};
pub use world::SceneWorld;
