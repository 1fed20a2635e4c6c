//! The `area-light` pass.

use lobelia_frame::{AreaLightVisibility, Axis, GBuffer, ImageShape, LightClass, LightTransport, Radiance, SceneWorld};
use lobelia_graph::{
    BuildError, ClaimOf, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OutputShapes, ParamValue, Pass, PlanContext,
    PortError, Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_scene::Ndf;
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Lights every pixel by all area lights.
pub struct AreaLightPass {
    pipeline: ComputePipeline,
    settings: wgpu::Buffer,
}

/// Which specular lobe is integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lobe {
    /// The microfacet lobe of the scene's materials: GGX, or Blinn-Phong where the scene's distribution is Phong.
    #[default]
    Scene,
    /// The same with Beckmann's distribution of the same alpha.
    Beckmann,
    /// A cosine lobe about the mirror direction.
    Phong,
    /// The same times the cosine to the normal.
    PhongTwoAxis,
}

impl ParamValue for Lobe {
    fn kind() -> String {
        "scene, beckmann, phong or phong_two_axis".into()
    }
}

/// How a microfacet lobe is integrated over a light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// The radial primitive of the distribution along the light's edges as half vectors see them.
    #[default]
    ExactBoundary,
    /// Great circles between the half vectors of the corners.
    Vertices,
    /// The same with every edge split where it is nearest to the mirror direction.
    Split,
    /// The same with the split moved towards the middle for wide lobes.
    SplitBalanced,
}

impl ParamValue for Method {
    fn kind() -> String {
        "exact_boundary, vertices, split or split_balanced".into()
    }
}

/// How the integral of a cosine lobe along an edge is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EdgeIntegral {
    /// A Lorentzian peak.
    Lorentzian,
    /// A blend of a Lorentzian and a Pearson VII peak.
    LorentzianPearson,
    /// A blend of an ellipse's peak and its square.
    Ellipsoid,
    /// Owen's T function.
    #[default]
    Owen,
}

impl ParamValue for EdgeIntegral {
    fn kind() -> String {
        "lorentzian, lorentzian_pearson, ellipsoid or owen".into()
    }
}

/// What stands for the rim of a disk, a sphere or a map of one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Round {
    /// Arcs of circles as the surface sees them.
    #[default]
    Arcs,
    /// The regular polygon of equal area.
    Polygon,
    /// A quad that turns with the mirror direction.
    SpinningQuad,
}

impl ParamValue for Round {
    fn kind() -> String {
        "arcs, polygon or spinning_quad".into()
    }
}

/// Parameters of `area-light`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct Params {
    /// Which specular lobe: that of the scene's materials (`scene`), that with Beckmann's distribution (`beckmann`, by `exact_boundary` only), a cosine lobe about the mirror direction as wide (`phong`), or that times the cosine to
    /// the normal (`phong_two_axis`).
    pub lobe: Lobe,
    /// How a microfacet lobe is integrated: exactly (`exact_boundary`), or after Lecocq et al. 2017 with edges that are great arcs in half vectors (`vertices`,
    /// `split`, `split_balanced`) and GGX as a mix of cosine lobes.
    pub method: Method,
    /// How a cosine lobe is integrated along an edge; nothing else has one. Largest error of an edge: 0.013 of the lobe for the peaks, 4e-5 for `owen` with 3
    /// nodes.
    pub edge: EdgeIntegral,
    /// Quadrature nodes of `owen`. Root mean square error: 9e-5, 7e-6 and 3e-7 of the lobe with 2, 3 and 4 at an exponent of 100.
    #[param(range = 2..=4)]
    pub edge_nodes: u32,
    /// Quadrature nodes on either side of an edge's point nearest to the lobe: 2, 3, 4 or 6. Relative error of a GGX lobe up to 70 degrees from the normal: 2 %, 0.3 %, 0.1 % and 1e-4; at 85 degrees
    /// 8 %, 2 %, 0.3 % and 4e-4.
    #[param(range = 2..=6)]
    pub boundary_nodes: u32,
    /// What stands for the rim of a disk, a sphere or a map of one: arcs of circles as the surface sees them (`arcs`; for GGX by `exact_boundary`, other lobes take the polygon), the regular
    /// polygon of equal area (`polygon`), or the quad of Lecocq et al. 2017 that turns with the mirror direction (`spinning_quad`; 10 to 25 % off).
    pub round: Round,
    /// Arcs of a whole rim; spheres are exact with their four. Relative error for ellipses: 0.2 % with 8 (3 % where a sharp lobe ends at the rim), 0.02 % with 16.
    #[param(range = 4..=64)]
    pub round_arcs: u32,
    /// Corners of the polygon.
    #[param(range = 8..=64)]
    pub round_sides: u32,
    /// Brushed surfaces: alphas are alpha (1 + anisotropy) along the tangent and alpha (1 - anisotropy) across it, for all materials. GGX by `exact_boundary` only.
    #[param(range = -0.95..=0.95)]
    pub anisotropy: f32,
    /// Scene axis whose part along a surface is its tangent.
    pub tangent: Axis,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            lobe: Lobe::Scene,
            method: Method::ExactBoundary,
            edge: EdgeIntegral::Owen,
            edge_nodes: 3,
            boundary_nodes: 4,
            round: Round::Arcs,
            round_arcs: 8,
            round_sides: 16,
            anisotropy: 0.0,
            tangent: Axis::X,
        }
    }
}

impl Params {
    /// Whether the specular lobe is GGX, integrated as such.
    fn integrates_ggx(&self, ndf: Ndf) -> bool {
        self.lobe == Lobe::Scene && self.method == Method::ExactBoundary && ndf == Ndf::Ggx
    }
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// What the camera sees.
    pub gbuffer: GBuffer,
    /// How much of every light is seen; without it nothing casts a shadow.
    pub visibility: Option<AreaLightVisibility>,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// Light of area lights that scattered exactly once.
    pub radiance: Radiance,
}

/// Group and workgroups.
pub struct Bindings {
    group: wgpu::BindGroup,
    workgroups: [u32; 2],
}

impl Pass for AreaLightPass {
    const NAME: &'static str = "area-light";
    const DOC: &'static str = "Direct light of polygonal, disk and sphere lights in closed form, without tables.\n\
        Light that scatters exactly once. Lambert's formula and the radial primitive of the microfacet distribution, integrated along the outline of each \
        light (after Lecocq et al. 2017); any simple polygon, ellipses and ellipsoids, one-sided or not. Without visibility nothing casts a shadow. Methods with great \
        arcs stand for GGX by cosine lobes that end where GGX goes on; for lights beyond (about 7 alpha from the normal in half vectors) GGX is integrated itself.";
    type World = SceneWorld;
    type Params = Params;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &Params, traits: &TraitsOf<Self>) -> Need {
        if traits.area_lights() > 0 { Need::Run } else { Need::Omit("the scene has no area light".into()) }
    }

    fn claim(_: &Params, _: &TraitsOf<Self>) -> Option<ClaimOf<Self>> {
        Some(LightTransport::of(LightClass::Area, [1]))
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let traits = context.traits;
        let mut found = inputs.gbuffer.flags.reflectance(traits.ndf);
        let visibility = inputs.visibility.is_some();
        let reason = if visibility { "visibility is connected" } else { "no visibility is connected" };
        found.push(Specialisation::new("VISIBILITY", visibility, reason));
        let has = |count: usize, what: &str| match count {
            0 => format!("the scene has no {what} light: its code is dropped"),
            _ => format!("the scene has {count} {what} light(s)"),
        };
        let (flat, disks, spheres) = (traits.flat_lights(), traits.disk_lights, traits.sphere_lights);
        found.push(Specialisation::new("POLYGON_LIGHTS", flat > 0, has(flat, "quad or polygon")));
        found.push(Specialisation::new("DISK_LIGHTS", disks > 0, has(disks, "disk")));
        found.push(Specialisation::new("SPHERE_LIGHTS", spheres > 0, has(spheres, "sphere")));
        let Params { lobe, method, edge, edge_nodes, .. } = *context.params;
        let lobe_is = format!("lobe is {}", ["scene", "beckmann", "phong", "phong_two_axis"][lobe as usize]);
        found.push(Specialisation::new("LOBE_COSINE", matches!(lobe, Lobe::Phong | Lobe::PhongTwoAxis), lobe_is.clone()));
        found.push(Specialisation::new("NDF_BECKMANN", lobe == Lobe::Beckmann, lobe_is.clone()));
        found.push(Specialisation::new("LOBE_TWO_AXIS", lobe == Lobe::PhongTwoAxis, lobe_is.clone()));
        let method_is = format!("method is {}", ["exact_boundary", "vertices", "split", "split_balanced"][method as usize]);
        let split = matches!(method, Method::Split | Method::SplitBalanced);
        found.push(Specialisation::new("METHOD_GREAT_ARCS", method != Method::ExactBoundary, method_is.clone()));
        found.push(Specialisation::new("METHOD_SPLIT", split, method_is.clone()));
        found.push(Specialisation::new("METHOD_BALANCED", method == Method::SplitBalanced, method_is.clone()));
        let edge_is = format!("edge is {}", ["lorentzian", "lorentzian_pearson", "ellipsoid", "owen"][edge as usize]);
        found.push(Specialisation::new("EDGE_PEAK", edge != EdgeIntegral::Owen, edge_is.clone()));
        found.push(Specialisation::new("EDGE_LORENTZIAN", edge == EdgeIntegral::Lorentzian, edge_is.clone()));
        found.push(Specialisation::new("EDGE_ELLIPSOID", edge == EdgeIntegral::Ellipsoid, edge_is));
        found.push(Specialisation::new("EDGE_NODES_TWO", edge_nodes == 2, format!("edge_nodes is {edge_nodes}")));
        found.push(Specialisation::new("EDGE_NODES_FOUR", edge_nodes == 4, format!("edge_nodes is {edge_nodes}")));
        let ggx = context.params.integrates_ggx(traits.ndf);
        found.push(Specialisation::new("LOBE_GGX", ggx, format!("{lobe_is}, {method_is}, distribution {:?}", traits.ndf)));
        let round = context.params.round;
        let round_is = format!("round is {}", ["arcs", "polygon", "spinning_quad"][round as usize]);
        let lights = disks + spheres > 0;
        let arcs = round == Round::Arcs && lights && (ggx || !inputs.gbuffer.flags.specular);
        found.push(Specialisation::new("ROUND_ARCS", arcs, round_is.clone()));
        found.push(Specialisation::new("ROUND_SPINNING_QUAD", round == Round::SpinningQuad && lights, round_is));
        let anisotropy = context.params.anisotropy;
        found.push(Specialisation::new("ANISOTROPIC", anisotropy != 0.0, format!("anisotropy is {anisotropy}")));
        let nodes = context.params.boundary_nodes;
        for (flag, count) in [("HALF_VECTOR_NODES_TWO", 2), ("HALF_VECTOR_NODES_FOUR", 4), ("HALF_VECTOR_NODES_SIX", 6)] {
            found.push(Specialisation::new(flag, nodes == count, format!("boundary_nodes is {nodes}")));
        }
        found
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        if context.params.lobe == Lobe::Beckmann && context.params.method != Method::ExactBoundary {
            return Err(PortError::at("radiance", "lobe beckmann is integrated by method exact_boundary only"));
        }
        if context.params.anisotropy != 0.0 && !context.params.integrates_ggx(context.traits.ndf) {
            return Err(PortError::at(
                "radiance",
                "anisotropy is for GGX lobes (`lobe: scene`, distribution ggx) and method exact_boundary only",
            ));
        }
        if context.params.boundary_nodes == 5 {
            return Err(PortError::at("radiance", "boundary_nodes is 5, but must be 2, 3, 4 or 6"));
        }
        if let Some(visibility) = &inputs.visibility {
            visibility.check(inputs.gbuffer.extent)?;
        }
        Ok(OutputsShapes { radiance: ImageShape { extent: inputs.gbuffer.extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/arealight-ltc-free/src/area_light.wgsl", text: include_str!("area_light.wgsl") };
        let pipeline = context.gpu.compute_pipeline(context.name, source, "area_light", context.flags)?;
        let settings = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("area light settings"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let words = [
            context.world.area_light_count,
            if context.flags.has("ROUND_ARCS") { context.params.round_arcs } else { context.params.round_sides },
            context.params.tangent.index(),
            context.params.anisotropy.to_bits(),
        ];
        context.gpu.queue().write_buffer(&settings, 0, bytemuck::cast_slice(&words));
        Ok(Self { pipeline, settings })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let gbuffer = &inputs.gbuffer;
        let mut bindings = self
            .pipeline
            .bindings(0)
            .raw_buffer("view", &context.world.view)
            .raw_buffer("settings", &self.settings)
            .raw_buffer("lights", &context.world.area_lights)
            .texture("gbuffer_depth", &gbuffer.depth)
            .texture("gbuffer_core", &gbuffer.core)
            .texture_if("gbuffer_specular", gbuffer.specular.as_ref())
            .texture_if("gbuffer_geometric_normal", gbuffer.geometric_normal.as_ref())
            .texture("radiance", &outputs.radiance.image);
        if context.world.traits.flat_lights() > 0 {
            bindings = bindings.raw_buffer("corners", &context.world.area_light_vertices);
        }
        if let Some(visibility) = &inputs.visibility {
            bindings = bindings.texture("visible", &visibility.share);
        }
        Ok(Bindings { group: bindings.build(context.gpu)?, workgroups: self.pipeline.workgroups_2d(outputs.radiance.shape.extent) })
    }

    fn record(&mut self, frame: &mut Frame<'_>, _: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        frame.compute("light pixels", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            pass.set_bind_group(0, &bindings.group, &[]);
            pass.dispatch_workgroups(bindings.workgroups[0], bindings.workgroups[1], 1);
        });
        Ok(())
    }
}
