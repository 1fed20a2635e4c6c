//! What the passes of this crate have in common: ports, flags, bindings, and the dispatch over pixels. A technique is a piece of shader that says what one light
//! sends, and its settings.

use crate::table::LtcTable;
use lobelia_frame::{AreaLightVisibility, Axis, GBuffer, ImageShape, LightClass, LightTransport, Radiance, SceneWorld};
use lobelia_graph::{
    BuildError, ClaimOf, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, Need, OutputShapes, Params, Pass, PlanContext,
    PortError, Ports, RunError, Specialisation, TraitsOf,
};
use lobelia_scene::{AreaShape, Ndf, Scene, triangulate};
use lobelia_shaders::Source;
use std::marker::PhantomData;

/// A way to light a pixel by one area light.
pub trait Technique: 'static {
    const NAME: &'static str;
    const DOC: &'static str;
    /// Path and text of the shader: `shared.wgsl` and a function `light_from`.
    const SHADER: Source<'static>;
    type Params: Params;
    /// Two numbers for the shader.
    fn settings(params: &Self::Params) -> [u32; 2];
    /// How alphas of surfaces differ along a tangent and across it (see `lobelia_lobes::anisotropic_ggx`), and the axis that the tangent is from.
    fn anisotropy(_: &Self::Params) -> (f32, Axis) {
        (0.0, Axis::X)
    }
    /// Whether it works with a distribution of normals, and why not.
    fn refuses(_: &Self::Params, _: Ndf) -> Option<&'static str> {
        None
    }
    /// The table that its shader reads.
    fn table() -> Option<LtcTable> {
        None
    }
    /// Whether its shader wants polygons as triangles.
    const TRIANGLES: bool = false;
}

/// A pass that lights every pixel by all area lights.
pub struct PeerPass<T> {
    pipeline: ComputePipeline,
    settings: wgpu::Buffer,
    table: Option<wgpu::Buffer>,
    /// Ranges of triangles for every light, and their corners as places in the scene's array.
    triangles: Option<[wgpu::Buffer; 2]>,
    technique: PhantomData<T>,
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

/// For every light the range of its triangles, then the triangles. They hold as long as corners keep their order, however the light moves.
fn triangles_of(scene: &Scene) -> (Vec<[u32; 2]>, Vec<[u32; 4]>) {
    let (mut ranges, mut triangles, mut first_corner) = (Vec::new(), Vec::new(), 0);
    for light in &scene.area_lights {
        let first = triangles.len() as u32;
        if let (AreaShape::Quad { .. } | AreaShape::Polygon { .. }, Some(outline)) = (&light.shape, light.shape.outline()) {
            let mirrored = glam::DMat3::from_mat4(light.world_from_local).determinant() < 0.0;
            let count = outline.len();
            for corners in triangulate(&outline) {
                // A mirrored light has its corners in the other order.
                let place = |corner: usize| first_corner + if mirrored { count - 1 - corner } else { corner } as u32;
                let [a, b, c] = corners.map(place);
                triangles.push([a, b, c, 0]);
            }
            first_corner += count as u32;
        }
        ranges.push([first, triangles.len() as u32 - first]);
    }
    (ranges, triangles)
}

fn buffer(context: &lobelia_graph::Gpu, label: &str, bytes: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let size = (bytes.len().max(16) as u64).next_multiple_of(16);
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    let buffer = context.device().create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false });
    context.queue().write_buffer(&buffer, 0, bytes);
    buffer
}

impl<T: Technique> Pass for PeerPass<T> {
    const NAME: &'static str = T::NAME;
    const DOC: &'static str = T::DOC;
    type World = SceneWorld;
    type Params = T::Params;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn need(_: &T::Params, traits: &TraitsOf<Self>) -> Need {
        if traits.area_lights() > 0 { Need::Run } else { Need::Omit("the scene has no area light".into()) }
    }

    fn claim(_: &T::Params, _: &TraitsOf<Self>) -> Option<ClaimOf<Self>> {
        Some(LightTransport::of(LightClass::Area, [1]))
    }

    fn specialise(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Vec<Specialisation> {
        let traits = context.traits;
        let mut found = inputs.gbuffer.flags.reflectance(traits.ndf);
        let visibility = inputs.visibility.is_some();
        let reason = if visibility { "visibility is connected" } else { "no visibility is connected" };
        found.push(Specialisation::new("VISIBILITY", visibility, reason));
        let (anisotropy, _) = T::anisotropy(context.params);
        found.push(Specialisation::new("ANISOTROPIC", anisotropy != 0.0, format!("anisotropy is {anisotropy}")));
        let shapes = [
            ("POLYGON_LIGHTS", traits.flat_lights(), "quad or polygon"),
            ("DISK_LIGHTS", traits.disk_lights, "disk"),
            ("SPHERE_LIGHTS", traits.sphere_lights, "sphere"),
        ];
        found.extend(shapes.map(|(flag, count, what)| {
            let reason = match count {
                0 => format!("the scene has no {what} light: its code is dropped"),
                _ => format!("the scene has {count} {what} light(s)"),
            };
            Specialisation::new(flag, count > 0, reason)
        }));
        found
    }

    fn shape(context: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        if inputs.gbuffer.flags.specular
            && let Some(reason) = T::refuses(context.params, context.traits.ndf)
        {
            return Err(PortError::at("radiance", reason));
        }
        if let Some(visibility) = &inputs.visibility {
            visibility.check(inputs.gbuffer.extent)?;
        }
        Ok(OutputsShapes { radiance: ImageShape { extent: inputs.gbuffer.extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let gpu = context.gpu;
        let pipeline = gpu.compute_pipeline(context.name, T::SHADER, "light_pixels", context.flags)?;
        let storage = |label: &str, bytes: &[u8]| buffer(gpu, label, bytes, wgpu::BufferUsages::STORAGE);
        let table = T::table();
        let [a, b] = T::settings(context.params);
        let (anisotropy, tangent) = T::anisotropy(context.params);
        let table_size = table.as_ref().map_or(0, |table| table.size);
        let words = [context.world.area_light_count, table_size, a, b, tangent.index(), anisotropy.to_bits(), 0, 0];
        // Six numbers in eight, so that they are read as two vectors.
        let padded = table.map(|table| {
            table.fits.iter().flat_map(|fit| [fit[0], fit[1], fit[2], fit[3], fit[4], fit[5], 0.0, 0.0]).collect::<Vec<f32>>()
        });
        let triangles = T::TRIANGLES.then(|| {
            let (ranges, triangles) = triangles_of(&context.world.scene);
            [
                storage("ranges of triangles", bytemuck::cast_slice(&ranges)),
                storage("triangles of lights", bytemuck::cast_slice(&triangles)),
            ]
        });
        Ok(Self {
            pipeline,
            settings: buffer(gpu, "area light settings", bytemuck::cast_slice(&words), wgpu::BufferUsages::UNIFORM),
            table: padded.map(|padded| storage("linearly transformed cosines", bytemuck::cast_slice(&padded))),
            triangles,
            technique: PhantomData,
        })
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
            if let Some([ranges, triangles]) = &self.triangles {
                bindings = bindings.raw_buffer("ranges", ranges).raw_buffer("triangles", triangles);
            }
        }
        if let (Some(table), true) = (&self.table, gbuffer.specular.is_some()) {
            bindings = bindings.raw_buffer("table", table);
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
