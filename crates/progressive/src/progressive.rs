//! The `progressive` pass.

use lobelia_frame::{ImageShape, Radiance, SceneWorld};
use lobelia_graph::{
    BuildError, ComputePipeline, CreateContext, DeviceOf, Frame, InputShapes, MAX_STORAGE_BINDING, OutputShapes, Params, Pass, PlanContext,
    PortError, Ports, RunError,
};
use lobelia_shaders::Source;
use serde::{Deserialize, Serialize};

/// Parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, Params)]
#[serde(default, deny_unknown_fields)]
pub struct ProgressiveParams {
    /// How many frames are averaged; later ones are not looked at, and the picture stands still. 0: as many as the sum can hold, 16777216.
    #[param(unit = "frames", range = 0..=16_777_216)]
    pub frames: u32,
}

/// As many half floats as 64 bits can add up.
const MOST_FRAMES: u32 = 1 << 24;

/// Bytes of a pixel's sums.
const PIXEL: u64 = 24;

/// Averages frames.
pub struct ProgressivePass {
    pipeline: ComputePipeline,
    /// Pictures whose sums exceed a binding are cut into parts of whole rows.
    parts: Vec<PicturePart>,
    limit: u32,
    /// Frames in the sums.
    frames: u32,
    /// Of the scene when the sums began.
    version: u64,
}

/// Rows of the picture with a buffer of their own.
struct PicturePart {
    row: u32,
    rows: u32,
    sums: wgpu::Buffer,
    settings: wgpu::Buffer,
}

/// Input ports.
#[derive(Ports)]
pub struct Inputs {
    /// The radiance of one frame.
    pub radiance: Radiance,
}

/// Output ports.
#[derive(Ports)]
pub struct Outputs {
    /// The mean over frames, rounded once, to half floats.
    pub radiance: Radiance,
}

/// Groups and workgroups, one for each part.
pub struct Bindings {
    parts: Vec<(wgpu::BindGroup, [u32; 2])>,
}

/// How many rows of a picture fit a binding, one at least.
fn rows_of_part(extent: [u32; 2]) -> u32 {
    let rows = MAX_STORAGE_BINDING / (PIXEL * u64::from(extent[0].max(1)));
    rows.clamp(1, u64::from(extent[1].max(1))) as u32
}

impl Pass for ProgressivePass {
    const NAME: &'static str = "progressive";
    const DOC: &'static str = "Shows the mean of all frames since scene or camera last changed.\n\
        Give every frame random numbers and sub-pixel offsets of its own: `lobelia render --progressive --frames N`.";
    type World = SceneWorld;
    type Params = ProgressiveParams;
    type Inputs = Inputs;
    type Outputs = Outputs;
    type Bindings = Bindings;

    fn shape(_: &PlanContext<'_, Self>, inputs: &InputShapes<Self>) -> Result<OutputShapes<Self>, PortError> {
        Ok(OutputsShapes { radiance: ImageShape { extent: inputs.radiance.extent } })
    }

    fn create(context: &CreateContext<'_, Self>) -> Result<Self, BuildError> {
        let source = Source { path: "crates/progressive/src/progressive.wgsl", text: include_str!("progressive.wgsl") };
        let pipeline = context.gpu.compute_pipeline(context.name, source, "accumulate", context.flags)?;
        let extent = context.outputs.radiance.extent;
        let device = context.gpu.device();
        let buffer = |label: &str, size: u64, usage: wgpu::BufferUsages| {
            device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: false })
        };
        let most = rows_of_part(extent);
        let parts = (0..extent[1]).step_by(most as usize).map(|row| {
            let rows = most.min(extent[1] - row);
            let size = PIXEL * u64::from(extent[0]) * u64::from(rows);
            PicturePart {
                row,
                rows,
                sums: buffer("sums over frames", size, wgpu::BufferUsages::STORAGE),
                settings: buffer("progressive", 16, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST),
            }
        });
        let limit = if context.params.frames == 0 { MOST_FRAMES } else { context.params.frames.min(MOST_FRAMES) };
        Ok(Self { pipeline, parts: parts.collect(), limit, frames: 0, version: context.world.picture_version() })
    }

    fn bind(&self, context: &CreateContext<'_, Self>, inputs: &Inputs, outputs: &Outputs) -> Result<Bindings, BuildError> {
        let width = outputs.radiance.shape.extent[0];
        let part = |part: &PicturePart| {
            let bindings = self.pipeline.bindings(0).raw_buffer("settings", &part.settings).raw_buffer("sums", &part.sums);
            let bindings = bindings.texture("source", &inputs.radiance.image).texture("radiance", &outputs.radiance.image);
            Ok((bindings.build(context.gpu)?, self.pipeline.workgroups_2d([width, part.rows])))
        };
        Ok(Bindings { parts: self.parts.iter().map(part).collect::<Result<_, BuildError>>()? })
    }

    fn record(&mut self, frame: &mut Frame<'_>, world: &DeviceOf<Self>, bindings: &Bindings) -> Result<(), RunError> {
        if !frame.history_is_valid() || world.picture_version() != self.version {
            self.frames = 0;
            self.version = world.picture_version();
        }
        let first = self.frames == 0;
        let added = self.frames < self.limit;
        self.frames += u32::from(added);
        for part in &self.parts {
            let settings = [self.frames, u32::from(added), u32::from(first), part.row];
            frame.write_buffer(&part.settings, bytemuck::bytes_of(&settings));
        }
        frame.compute("accumulate", |pass| {
            pass.set_pipeline(self.pipeline.raw());
            for (group, [x, y]) in &bindings.parts {
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups(*x, *y, 1);
            }
        });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::{MAX_STORAGE_BINDING, PIXEL, rows_of_part};

    #[test]
    fn every_part_fits_a_binding() {
        for extent in [[1, 1], [1920, 1080], [3840, 2160], [8192, 8192]] {
            let rows = rows_of_part(extent);
            assert!(rows >= 1 && rows <= extent[1]);
            assert!(u64::from(rows) * u64::from(extent[0]) * PIXEL <= MAX_STORAGE_BINDING, "{extent:?}");
        }
        assert_eq!(rows_of_part([1920, 1080]), 1080);
        assert_eq!(rows_of_part([8192, 8192]), 682);
    }
}
