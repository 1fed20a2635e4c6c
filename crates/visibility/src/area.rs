//! The `area-visibility` pass.

use crate::hierarchy::Hierarchy;
use glam::{DMat3, DVec3};
use lobelia_frame::{AreaLightVisibility, AreaLightVisibilityShape, GBuffer, SceneWorld};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, MAX_STORAGE_BINDING, Need, OutputShapes, Pass, PlanContext,
    PortError, Ports, RunError, Specialisation, TraitsOf, WorkRate,
};
use lobelia_lobes::sampling::{r2_point, sample_sphere};
use lobelia_scene::{AreaLight, AreaShape, Scene, Triangle, triangulate};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Traces shadow rays from every pixel to points of every area light.
pub struct AreaVisibilityPass {
    pipeline: ComputePipeline,
    settings: wgpu::Buffer,
    nodes: wgpu::Buffer,
    triangles: wgpu::Buffer,
    points: wgpu::Buffer,
    /// Of the scene that all of it was made for.
    version: u64,
    seed: u32,
    extent: [u32; 2],
    lights: u32,
    samples: u32,
    rate: WorkRate,
}

/// Parameters of `area-visibility`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, lobelia_graph::Params)]
#[serde(default, deny_unknown_fields)]
pub struct AreaVisibilityParams {
    /// Rays from every pixel to every light. Penumbras are noisy by about one over their number.
    #[param(unit = "rays", range = 1..=1024)]
    pub samples: u32,
    /// Added to the run's seed, to try other points with everything else equal.
    pub seed: u32,
}

impl Default for AreaVisibilityParams {
    fn default() -> Self {
        Self { samples: 16, seed: 0 }
    }
}

/// Input ports.
#[derive(Ports)]
pub struct AreaInputs {
    /// Where rays start.
    pub gbuffer: GBuffer,
}

/// Output ports.
#[derive(Ports)]
pub struct AreaOutputs {
    /// How much of every light is seen.
    pub visibility: AreaLightVisibility,
}

/// Group and workgroups.
pub struct AreaBindings {
    group: wgpu::BindGroup,
    workgroups: [u32; 2],
    range: wgpu::Buffer,
}

/// Points on each light. A pixel takes as many as it has rays, from a place of its own on.
const POINTS: u32 = 4096;

/// Rays cost about this many times what gathering one light does; only how work is split depends on it.
const RAY_COST: f64 = 6.0;

/// A point of a light: position, the way it emits to, and in w of the latter whether it emits both ways. Uniform over the surface.
fn points_on(light: &AreaLight, origin: DVec3) -> Vec<[f32; 8]> {
    let axes = DMat3::from_mat4(light.world_from_local);
    let flat = axes.x_axis.cross(axes.y_axis);
    // Local -Z, whichever way the frame is turned.
    let flat = if flat.dot(axes.z_axis) >= 0.0 { -flat } else { flat }.normalize_or(DVec3::NEG_Z);
    let outline: Vec<_> = light.shape.outline().unwrap_or_default();
    let triangles = triangulate(&outline);
    let area = |[a, b, c]: &[usize; 3]| f64::from((outline[*b] - outline[*a]).perp_dot(outline[*c] - outline[*a]).abs());
    let all: f64 = triangles.iter().map(area).sum();
    (0..POINTS)
        .map(|index| {
            let [u, v] = r2_point(index, 0x5eed);
            let (local, normal) = match &light.shape {
                AreaShape::Quad { .. } | AreaShape::Polygon { .. } => {
                    let (mut rest, mut chosen) = (u * all, triangles.len().saturating_sub(1));
                    for (place, triangle) in triangles.iter().enumerate() {
                        let share = area(triangle);
                        if rest < share {
                            chosen = place;
                            break;
                        }
                        rest -= share;
                    }
                    let [a, b, c] = triangles
                        .get(chosen)
                        .map_or([DVec3::ZERO; 3], |corners| corners.map(|corner| outline[corner].as_dvec2().extend(0.0)));
                    let root = (rest / triangles.get(chosen).map_or(1.0, area).max(1e-30)).clamp(0.0, 1.0).sqrt();
                    (a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v), flat)
                }
                AreaShape::Disk { radius } => {
                    let (radius, angle) = (f64::from(*radius) * u.sqrt(), std::f64::consts::TAU * v);
                    (DVec3::new(radius * angle.cos(), radius * angle.sin(), 0.0), flat)
                }
                AreaShape::Sphere { radius } => {
                    let direction = sample_sphere([u, v]);
                    // Not uniform over an ellipsoid: only shares of what is seen depend on it.
                    let normal = (axes.inverse().transpose() * direction).normalize_or(DVec3::Z);
                    (direction * f64::from(*radius), normal)
                }
            };
            let position = (light.world_from_local.transform_point3(local) - origin).as_vec3();
            let (normal, both) = (normal.as_vec3(), if light.two_sided { 1.0 } else { 0.0 });
            [position.x, position.y, position.z, 0.0, normal.x, normal.y, normal.z, both]
        })
        .collect()
}

fn all_points(scene: &Scene) -> Vec<[f32; 8]> {
    scene.area_lights.iter().flat_map(|light| points_on(light, scene.origin())).collect()
}

/// What blocks light: everything but the surfaces of area lights, which would stand in their own way.
fn blockers(scene: &Scene) -> Vec<Triangle> {
    scene.triangles().into_iter().filter(|triangle| scene.instances[triangle.instance].area_light.is_none()).collect()
}

impl Pass for AreaVisibilityPass {
    const NAME: &'static str = "area-visibility";
    const DOC: &'static str = "How much of every area light each pixel sees, by shadow rays to points on it.\n\
        Rays against a bounding volume hierarchy of the scene's triangles, weighted by the irradiance that each point would send. Surfaces of area lights block nothing.";
    type World = SceneWorld;
    type Params = AreaVisibilityParams;
    type Inputs = AreaInputs;
    type Outputs = AreaOutputs;
    type Bindings = AreaBindings;

    fn need(_: &AreaVisibilityParams, traits: &TraitsOf<Self>) -> Need {
        if traits.area_lights() > 0 { Need::Run } else { Need::Omit("the scene has no area light".into()) }
    }

    fn specialise(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let normal_map = inputs.gbuffer.flags.normal_map;
        let reason = if normal_map { "rays start off the geometric normal" } else { "shading and geometric normal are the same" };
        vec![Specialisation::new("NORMAL_MAP", normal_map, reason)]
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        let lights = context.traits.area_lights() as u32;
        if lights > AreaLightVisibilityShape::MAX_LIGHTS {
            let most = AreaLightVisibilityShape::MAX_LIGHTS;
            return Err(PortError::at("visibility", format!("the scene has {lights} area lights; visibility has at most {most} layers")));
        }
        Ok(AreaOutputsShapes { visibility: AreaLightVisibilityShape { extent: inputs.gbuffer.extent, lights } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/visibility/src/area.wgsl", text: include_str!("area.wgsl") };
        let pipeline = context.gpu.compute_pipeline(context.name, source, "trace", context.flags)?;
        let scene = &context.world.scene;
        let hierarchy = Hierarchy::build(&blockers(scene));
        let mut nodes = hierarchy.nodes.clone();
        if context.traits.animated {
            // It is rebuilt, and its tree may have more nodes; there are never more than two per triangle.
            nodes.resize((4 * context.traits.triangles.max(1)).max(nodes.len()), [0; 4]);
        }
        let buffer = |label: &str, bytes: &[u8], usage: wgpu::BufferUsages| -> Result<wgpu::Buffer, BuildError> {
            if bytes.len() as u64 > MAX_STORAGE_BINDING {
                return Err(BuildError::Other(format!(
                    "the {label} of the scene take {} MiB; at most 128 can be bound",
                    bytes.len() >> 20
                )));
            }
            let size = (bytes.len().max(16) as u64).next_multiple_of(16);
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            let buffer =
                context.gpu.device().create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
            context.gpu.queue().write_buffer(&buffer, 0, bytes);
            Ok(buffer)
        };
        let storage = wgpu::BufferUsages::STORAGE;
        let pass = Self {
            pipeline,
            settings: buffer("settings", &[0; 16], wgpu::BufferUsages::UNIFORM)?,
            nodes: buffer("nodes", bytemuck::cast_slice(&nodes), storage)?,
            triangles: buffer("triangles", bytemuck::cast_slice(&hierarchy.triangles), storage)?,
            points: buffer("points on area lights", bytemuck::cast_slice(&all_points(scene)), storage)?,
            version: scene.geometry_version(),
            seed: context.params.seed,
            extent: context.inputs.gbuffer.extent,
            lights: context.world.area_light_count,
            samples: context.params.samples,
            rate: WorkRate::default(),
        };
        pass.write_settings(context.gpu.queue(), &hierarchy);
        Ok(pass)
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &AreaInputs, outputs: &AreaOutputs) -> Result<AreaBindings, BuildError> {
        let range = context.gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some("light range"),
            size: 16,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let gbuffer = &inputs.gbuffer;
        let bindings = self
            .pipeline
            .bindings(0)
            .raw_buffer("view", &context.world.view)
            .raw_buffer("settings", &self.settings)
            .raw_buffer("range", &range)
            .raw_buffer("nodes", &self.nodes)
            .raw_buffer("triangles", &self.triangles)
            .raw_buffer("points", &self.points)
            .texture("gbuffer_depth", &gbuffer.depth)
            .texture("share", &outputs.visibility.share);
        let bindings = match &gbuffer.geometric_normal {
            Some(normal) => bindings.texture("gbuffer_geometric_normal", normal),
            None => bindings.texture("gbuffer_core", &gbuffer.core),
        };
        let workgroups = self.pipeline.workgroups_2d(self.extent);
        Ok(AreaBindings { group: bindings.build(context.gpu)?, workgroups, range })
    }

    fn record(&mut self, frame: &mut Frame<'_>, world: &DeviceOf<Self>, bindings: &AreaBindings) -> Result<(), RunError> {
        self.follow(frame, &world.scene)?;
        let cost = f64::from(self.extent[0]) * f64::from(self.extent[1]) * f64::from(self.samples) * RAY_COST;
        let [x, y] = bindings.workgroups;
        let pipeline = &self.pipeline;
        frame.ranges(self.lights, 1, cost, &mut self.rate, |frame, lights| {
            frame.write_buffer(&bindings.range, bytemuck::cast_slice(&[lights.start, 0, 0, 0]));
            frame.compute("trace shadow rays", |pass| {
                pass.set_pipeline(pipeline.raw());
                pass.set_bind_group(0, &bindings.group, &[]);
                pass.dispatch_workgroups(x, y, lights.len() as u32);
            });
            Ok(())
        })
    }
}

impl AreaVisibilityPass {
    fn write_settings(&self, queue: &wgpu::Queue, hierarchy: &Hierarchy) {
        let nodes = (hierarchy.nodes.len() / 2) as u32;
        queue.write_buffer(&self.settings, 0, bytemuck::cast_slice(&[self.samples, self.seed, nodes, POINTS]));
    }

    /// Rebuilds everything after the scene moved.
    fn follow(&mut self, frame: &Frame<'_>, scene: &Scene) -> Result<(), RunError> {
        if scene.geometry_version() == self.version {
            return Ok(());
        }
        let hierarchy = Hierarchy::build(&blockers(scene));
        let fits = |rows: usize, buffer: &wgpu::Buffer| (rows * 16) as u64 <= buffer.size();
        if !fits(hierarchy.nodes.len(), &self.nodes) || !fits(hierarchy.triangles.len(), &self.triangles) {
            return Err(RunError::Pass { pass: frame.pass_name().into(), message: "the scene grew after the graph was created".into() });
        }
        frame.write_buffer(&self.nodes, bytemuck::cast_slice(&hierarchy.nodes));
        frame.write_buffer(&self.triangles, bytemuck::cast_slice(&hierarchy.triangles));
        frame.write_buffer(&self.points, bytemuck::cast_slice(&all_points(scene)));
        self.write_settings(frame.gpu().queue(), &hierarchy);
        self.version = scene.geometry_version();
        Ok(())
    }
}
