//! The `vsgl-lights` pass.

use lobelia_frame::{PatchMoments, ReflectiveShadowMap, SamplingDensity, SceneWorld, VirtualLights, VirtualLightsShape};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OrNone, OutputShapes, ParamValue, Params, Pass,
    PlanContext, PortError, Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Picks virtual spherical Gaussian lights from reflective shadow maps and their averages.
pub struct VsglLightsPass {
    pick: ComputePipeline,
    settings: wgpu::Buffer,
    params: VsglLightsParams,
    side: u32,
    faces: u32,
}

/// How the size of a light's patch follows from the sampling density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kernel {
    /// The patch holds `overlap / count` of the density, which is averaged as its flux is (a form of this project, after Tokuyoshi 2016).
    #[default]
    Mean,
    /// The density at the patch's centre stands for all of it (Krivanek and Colbert 2008, as in Tokuyoshi 2014): loses light at the borders of what is lit.
    Centre,
}

impl ParamValue for Kernel {
    fn kind() -> String {
        "mean or centre".into()
    }
}

/// Parameters of `vsgl-lights`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct VsglLightsParams {
    /// Number of lights N. More lights are smaller: less blur and linearly more time.
    #[param(unit = "lights", range = 1..=65536)]
    pub count: u32,
    /// How many lights' patches cover each place, k. More: smoother; less: sharper, with more noise. The 2014 brief's 4 is that of its bilinear filter's block; the
    /// whole filter is three times as wide, and this counts all of it.
    #[param(unit = "lights", range = 0.0625..=256.0)]
    pub overlap: f32,
    /// How a patch's size follows from the density.
    pub kernel: Kernel,
    /// Blocks of texels whose positions or normals vary more than this many times as much as those of a flat (or evenly curved) surface, as they do across an
    /// edge, do not count in a patch: it stays on its own surface. `none` lets it grow across.
    #[param(range = 1.0..)]
    pub edges: OrNone<f32>,
    /// Least radius of a light, in units of that of a flat patch of its share: among leaves and folds patches find no room to grow, and would be points.
    /// Larger: fewer spots, but more of the light that folds and contacts send each other is lost.
    #[param(range = 0.0..=4.0)]
    pub least_radius: f32,
    /// Shrink patches from frame to frame, each frame with lights of its own, so that the mean over frames converges (with the pass `progressive`, and
    /// bias reduction in the gathering): the variance of frame i + 1 is (i + 2/3) / (i + 1) times that of frame i.
    pub shrink: bool,
    /// Added to the run's seed, to try another set of lights with everything else equal.
    pub seed: u32,
}

impl Default for VsglLightsParams {
    fn default() -> Self {
        Self { count: 1024, overlap: 2.0, kernel: Kernel::Mean, edges: OrNone::Value(3.0), least_radius: 0.7, shrink: false, seed: 0 }
    }
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// The patches to pick from.
    pub rsm: ReflectiveShadowMap,
    /// Their averages.
    pub moments: PatchMoments,
    /// How likely each of them is.
    pub density: SamplingDensity,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// The lights, with lobes.
    pub lights: VirtualLights,
}

impl Pass for VsglLightsPass {
    const NAME: &'static str = "vsgl-lights";
    const DOC: &'static str = "Picks virtual spherical Gaussian lights from reflective shadow maps, each a patch with a lobe.\n\
        Tokuyoshi 2014. Filtered importance sampling: where lights are sparse a light's patch is large. Position, radius, flux and lobes come from averages over \
        the patch; every record also holds the point at its centre, so that a pass may gather it as a virtual point light.";
    type World = SceneWorld;
    type Params = VsglLightsParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = wgpu::BindGroup;

    fn need(_: &VsglLightsParams, traits: &TraitsOf<Self>) -> Need {
        if traits.punctual_lights() > 0 { Need::Run } else { Need::Omit("the scene has no point, spot or directional light".into()) }
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let mut found = inputs.rsm.flags.reflectance(context.traits.ndf);
        found.extend(inputs.moments.lobe_length.specialisations());
        let kernel = context.params.kernel;
        found.push(Specialisation::new(
            "KERNEL_CENTRE",
            kernel == Kernel::Centre,
            format!("kernel is {}", ["mean", "centre"][kernel as usize]),
        ));
        found
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        inputs.density.check(&inputs.rsm)?;
        inputs.moments.check(&inputs.rsm)?;
        Ok(OutputsShapes { lights: VirtualLightsShape { count: context.params.count, specular: inputs.rsm.flags.specular, lobes: true } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/vsgl/src/lights.wgsl", text: include_str!("lights.wgsl") };
        let settings = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("light picking"),
            size: 32,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        Ok(Self {
            pick: context.gpu.compute_pipeline(context.name, source, "pick", context.flags)?,
            settings,
            params: context.params.clone(),
            side: context.inputs.moments.side(),
            faces: context.inputs.moments.faces.max(1),
        })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<wgpu::BindGroup, BuildError> {
        let rsm = &inputs.rsm;
        self.pick
            .bindings(0)
            .raw_buffer("settings", &self.settings)
            .buffer("faces", &rsm.faces)
            .raw_buffer("lights", &context.world.lights)
            .texture("rsm_depth", &rsm.depth)
            .texture("rsm_core", &rsm.core)
            .texture_if("rsm_specular", rsm.specular.as_ref())
            .texture_if("rsm_geometric_normal", rsm.geometric_normal.as_ref())
            .texture("weights", &inputs.density.weights)
            .buffer("moments", &inputs.moments.moments)
            .buffer("virtual_lights", &outputs.lights.lights)
            .buffer_if("lobes", outputs.lights.lobes.as_ref())
            .build(context.gpu)
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, group: &wgpu::BindGroup) -> Result<(), RunError> {
        let params = &self.params;
        let mut seed = frame.info().seed.wrapping_add(params.seed);
        let mut overlap = f64::from(params.overlap);
        if params.shrink {
            let index = frame.info().index;
            overlap *= shrunk(index);
            // A step that is odd and far from the generators of the points.
            seed = seed.wrapping_add((index as u32).wrapping_mul(0x9e37_79b9));
        }
        let share = overlap / f64::from(params.count);
        let edges = params.edges.value().unwrap_or(f32::MAX);
        let words =
            [params.count, seed, self.side, self.faces, (share as f32).to_bits(), edges.to_bits(), params.least_radius.to_bits(), 0];
        frame.write_buffer(&self.settings, bytemuck::cast_slice(&words));
        let groups = params.count.div_ceil(64);
        frame.compute("pick lights", |pass| {
            pass.set_pipeline(self.pick.raw());
            pass.set_bind_group(0, group, &[]);
            pass.dispatch_workgroups(groups, 1, 1);
        });
        Ok(())
    }
}

/// Variance of frame `index` over that of the first: the product of `(i + 2/3) / (i + 1)`, which falls as `index^(-1/3)` (Knaus and Zwicker 2011; the 2014
/// brief prints a constant factor, with which noise would grow without bound).
fn shrunk(index: u64) -> f64 {
    // The product is Gamma(n + 2/3) / (Gamma(2/3) Gamma(n + 1)).
    let n = index as f64;
    if index < 64 {
        return (0..index).map(|i| (i as f64 + 2.0 / 3.0) / (i as f64 + 1.0)).product();
    }
    // Stirling's series of the ratio to two terms: relative error below 1e-6 from here on.
    let gamma = 1.354_117_939_426_400_4;
    n.powf(-1.0 / 3.0) * (1.0 - 1.0 / (9.0 * n)) / gamma
}

#[cfg(test)]
mod tests {
    use super::shrunk;

    #[test]
    fn the_radius_falls_as_the_paper_says() {
        assert_eq!(shrunk(0), 1.0);
        assert!((shrunk(1) - 2.0 / 3.0).abs() < 1e-15);
        assert!((shrunk(2) - 2.0 / 3.0 * 5.0 / 6.0).abs() < 1e-15);
        let product = |n: u64| (0..n).map(|i| (i as f64 + 2.0 / 3.0) / (i as f64 + 1.0)).product::<f64>();
        for n in [64, 65, 100, 1000, 100_000] {
            assert!((shrunk(n) / product(n) - 1.0).abs() < 5e-5, "{n}: {} {}", shrunk(n), product(n));
        }
    }
}
