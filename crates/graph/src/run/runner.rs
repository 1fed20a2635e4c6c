//! Owns every resource of a plan and runs it.

use crate::{
    check::{Checker, Finding},
    error::{GpuError, RunError},
    gpu::Gpu,
    pass::World,
    plan::{Plan, PlannedPass, PlannedResource},
    ports::PortValue,
    readback::TextureData,
    registry::{AnyPass, ErasedContext, ErasedPlanContext},
    resource::{Access, BufferPart, Part, PartHandle, PartKind, PartSet, Resource, TexturePart, Values},
    run::{
        Frame, FrameInfo,
        frame::{Connected, Progress},
    },
    timing::{FrameTimes, Timer},
};
use std::{any::Any, time::Instant};

/// How the time of passes is taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Timing {
    /// Not at all; nothing is added to the frame.
    #[default]
    Off,
    /// Timestamp queries at the edges of encoder passes, where the device has them; the frame runs as it always does.
    Timestamps,
    /// Each pass is submitted alone and waited for, and the wall clock is read. Works at the baseline; passes cannot overlap, so their sum
    /// is not the time of a frame.
    Isolated,
}

/// Choices of a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct RunOptions {
    /// Poisons resources before they are written and counts values that must not be there after every pass. Slow; for tests and for hunting a NaN.
    pub check: bool,
    /// How time is taken.
    pub timing: Timing,
}

/// Time of one pass in one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// Name in the graph.
    pub pass: String,
    /// Recording on the CPU, milliseconds.
    pub cpu_ms: f64,
    /// On the device, milliseconds: the sum over its encoder passes with [`Timing::Timestamps`], wall clock with [`Timing::Isolated`]; `None` if not measured.
    pub gpu_ms: Option<f64>,
}

/// What one frame took.
#[derive(Clone, Debug, Default)]
pub struct FrameReport {
    /// Per pass, in order.
    pub passes: Vec<PassTime>,
    /// Device spans with [`Timing::Timestamps`].
    pub spans: Option<FrameTimes>,
    /// With [`RunOptions::check`]: parts that hold half floats at 65504, where what is larger is cut off. Light is lost there, but nothing is broken.
    pub saturated: Vec<Finding>,
    /// Start and length of each pass's recording on the CPU, milliseconds since the frame began.
    pub cpu_spans: Vec<(String, f64, f64)>,
}

enum SlotHandle {
    Texture(wgpu::Texture),
    Buffer(wgpu::Buffer),
}

struct RunPass<W: World> {
    pass: Box<dyn AnyPass<W>>,
    /// One, or one for each side of the history swap.
    bindings: Vec<Box<dyn Any>>,
    /// What its ports are connected to, one per side.
    connected: Vec<Connected>,
}

/// A plan with its resources, pipelines and bind groups.
pub struct Runner<W: World> {
    plan: Plan<W>,
    options: RunOptions,
    slots: Vec<SlotHandle>,
    passes: Vec<RunPass<W>>,
    sides: usize,
    frame: u64,
    /// Frames since the histories were reset.
    age: u64,
    timer: Timer,
    checker: Option<Checker>,
    /// That of the last frame's world.
    pre_exposure: f32,
}

impl<W: World> Runner<W> {
    /// Allocates, creates and binds everything.
    pub fn new(gpu: &Gpu, plan: Plan<W>, world: &W::Device, options: RunOptions) -> Result<Self, RunError> {
        let sides = if plan.resources.iter().any(|resource| resource.history) { 2 } else { 1 };
        let slots = plan.slots.iter().map(|slot| allocate(gpu, &plan, slot)).collect();
        gpu.take_error()?;
        let mut runner = Self {
            plan,
            options,
            slots,
            passes: Vec::new(),
            sides,
            frame: 0,
            age: 0,
            timer: Timer::new(gpu, options.timing == Timing::Timestamps),
            checker: options.check.then(|| Checker::new(gpu)).transpose().map_err(safety_net)?,
            pre_exposure: W::pre_exposure(world),
        };
        runner.passes = runner.create_passes(gpu, world)?;
        gpu.take_error()?;
        Ok(runner)
    }

    fn create_passes(&self, gpu: &Gpu, world: &W::Device) -> Result<Vec<RunPass<W>>, RunError> {
        let mut passes = Vec::new();
        for planned in &self.plan.passes {
            let fail = |source| RunError::Build { pass: planned.name.clone(), kind: planned.kind_name(), source: Box::new(source) };
            let mut created: Option<Box<dyn AnyPass<W>>> = None;
            let (mut bindings, mut connected) = (Vec::new(), Vec::new());
            for side in 0..self.sides {
                let (inputs, outputs) = self.port_values(planned, side);
                let context = ErasedContext {
                    plan: ErasedPlanContext {
                        name: &planned.name,
                        params: planned.params.as_ref(),
                        traits: &self.plan.traits,
                        extent: self.plan.extent,
                    },
                    gpu,
                    world,
                    flags: &planned.flags,
                    inputs: &inputs,
                    outputs: &outputs,
                };
                let pass = match created.take() {
                    Some(pass) => pass,
                    None => planned.kind.create(&context).map_err(fail)?,
                };
                bindings.push(pass.bind(&context).map_err(fail)?);
                created = Some(pass);
                connected.push(self.connected(planned, side));
            }
            gpu.take_error().map_err(|error| fail(error.into()))?;
            if let Some(pass) = created {
                passes.push(RunPass { pass, bindings, connected });
            }
        }
        Ok(passes)
    }

    /// Parts of a resource on one side of the history swap.
    fn parts(&self, resource: &PlannedResource, side: usize, access: Access) -> PartSet {
        let offset = if resource.history { (side % 2) * resource.parts.len() } else { 0 };
        let parts = resource.parts.iter().enumerate().map(|(index, part)| {
            let label = format!("{}/{}", resource.name, part.name);
            let handle = match (&self.slots[resource.slots[offset + index]], &part.kind) {
                (SlotHandle::Texture(texture), PartKind::Texture(shape)) => {
                    PartHandle::Texture(TexturePart::new(texture.clone(), shape.clone(), access, label))
                }
                (SlotHandle::Buffer(buffer), _) => PartHandle::Buffer(BufferPart::new(buffer.clone(), access, label)),
                (SlotHandle::Texture(_), PartKind::Buffer(_)) => unreachable!("a slot is allocated by the kind of its parts"),
            };
            (part.name, handle)
        });
        PartSet::new(parts.collect())
    }

    fn port_values(&self, planned: &PlannedPass<W>, side: usize) -> (Vec<PortValue>, Vec<PortValue>) {
        let value = |resource: &PlannedResource, side: usize, access: Access| (resource.value(), self.parts(resource, side, access));
        let inputs = planned.inputs.iter().zip(planned.input_ports()).map(|(resources, port)| {
            let side = if port.history { side + 1 } else { side };
            let (shapes, parts) = resources.iter().map(|resource| value(&self.plan.resources[*resource], side, Access::Read)).unzip();
            PortValue { shapes, parts }
        });
        let outputs = planned.outputs.iter().map(|resource| {
            let (shape, parts) = value(&self.plan.resources[*resource], side, Access::Write);
            PortValue { shapes: vec![shape], parts: vec![parts] }
        });
        (inputs.collect(), outputs.collect())
    }

    fn connected(&self, planned: &PlannedPass<W>, side: usize) -> Connected {
        let mut connected = Connected::default();
        for (resources, port) in planned.inputs.iter().zip(planned.input_ports()) {
            for resource in resources {
                let planned = &self.plan.resources[*resource];
                let side = if port.history { side + 1 } else { side };
                connected.add(&planned.name, planned.type_name, planned.value(), self.parts(planned, side, Access::Read));
            }
        }
        for resource in &planned.outputs {
            let planned = &self.plan.resources[*resource];
            connected.add(&planned.name, planned.type_name, planned.value(), self.parts(planned, side, Access::Write));
        }
        connected
    }

    /// The plan that is run.
    pub fn plan(&self) -> &Plan<W> {
        &self.plan
    }

    /// Changes to another plan. Resources, and with them all histories, are made anew if anything differs (size, variant, parameter, flag);
    /// if nothing does, nothing happens. Pipelines come from the device's cache.
    pub fn update(&mut self, gpu: &Gpu, plan: Plan<W>, world: &W::Device) -> Result<(), RunError> {
        if plan.fingerprint() == self.plan.fingerprint() {
            return Ok(());
        }
        let frame = self.frame;
        *self = Self::new(gpu, plan, world, self.options)?;
        self.frame = frame;
        Ok(())
    }

    /// Forgets last frame's values: the next frame sees zeros and [`Frame::history_is_valid`] is `false`.
    pub fn reset_history(&mut self) {
        self.age = 0;
    }

    /// Runs one frame. `progress` hears of long work and may stop it by returning `false`.
    pub fn run(&mut self, gpu: &Gpu, world: &W::Device, seed: u32, progress: &mut Progress<'_>) -> Result<FrameReport, RunError> {
        let side = (self.frame % 2) as usize % self.sides;
        self.pre_exposure = W::pre_exposure(world);
        let info = FrameInfo { index: self.frame, seed };
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("lobelia frame") });
        if self.age == 0 && self.sides == 2 {
            self.clear_histories(gpu, &mut encoder);
        }
        let begin = Instant::now();
        let mut report = FrameReport::default();
        let isolated = self.options.timing == Timing::Isolated;
        for (planned, run) in self.plan.passes.iter().zip(&mut self.passes) {
            if let Some(checker) = &self.checker {
                poison(checker, &mut encoder, &self.plan, planned, &self.slots, side);
            }
            if isolated {
                flush(gpu, &mut encoder, &mut self.timer)?;
            }
            let start = begin.elapsed();
            let mut frame = Frame {
                gpu,
                encoder: &mut encoder,
                timer: &mut self.timer,
                pass: &planned.name,
                info,
                history_valid: self.age > 0,
                progress: &mut *progress,
                connected: &run.connected[side],
                waited: 0.0,
            };
            run.pass.record(&mut frame, world, run.bindings[side].as_ref())?;
            let waited_ms = frame.waited * 1e3;
            let recorded = begin.elapsed();
            let cpu_ms = ((recorded - start).as_secs_f64() * 1e3 - waited_ms).max(0.0);
            // Work that was split was waited for, so the wall clock knows how long it took.
            let mut gpu_ms = (waited_ms > 0.0).then_some(waited_ms);
            if isolated {
                flush(gpu, &mut encoder, &mut self.timer)?;
                gpu_ms = Some((begin.elapsed() - start).as_secs_f64() * 1e3);
            }
            if self.options.timing != Timing::Off {
                report.cpu_spans.push((planned.name.clone(), start.as_secs_f64() * 1e3, cpu_ms));
                report.passes.push(PassTime { pass: planned.name.clone(), cpu_ms, gpu_ms });
            }
            if let Some(checker) = &mut self.checker {
                count(checker, gpu, &mut encoder, &self.plan, planned, &run.connected[side])?;
            }
        }
        self.timer.resolve(&mut encoder);
        gpu.queue().submit([encoder.finish()]);
        self.timer.end_frame();
        self.frame += 1;
        self.age += 1;
        self.finish(gpu, info, &mut report)?;
        Ok(report)
    }

    /// What must wait for the device: times and findings. Nothing is waited for when neither is asked for.
    fn finish(&mut self, gpu: &Gpu, info: FrameInfo, report: &mut FrameReport) -> Result<(), RunError> {
        if let Some(checker) = &mut self.checker {
            let findings = checker.collect(gpu)?;
            if let Some(first) = findings.iter().find(|finding| finding.non_finite + finding.negative > 0) {
                let kind = self.plan.passes.iter().find(|pass| pass.name == first.pass).map_or("", PlannedPass::kind_name);
                return Err(RunError::BadValues {
                    pass: first.pass.clone(),
                    kind,
                    resource: first.resource.clone(),
                    frame: info.index,
                    non_finite: first.non_finite,
                    negative: first.negative,
                });
            }
            report.saturated = findings.into_iter().filter(|finding| finding.saturated > 0).collect();
        }
        if self.options.timing == Timing::Timestamps {
            gpu.wait()?;
            report.spans = self.timer.finished(gpu);
            if let Some(times) = &report.spans {
                for pass in &mut report.passes {
                    let spans = times.spans.iter().filter(|span| span.pass == pass.pass);
                    let total: f64 = spans.clone().map(|span| span.end_ms - span.start_ms).sum();
                    pass.gpu_ms = pass.gpu_ms.or(spans.count().ne(&0).then_some(total));
                }
            }
        }
        gpu.take_error()?;
        Ok(())
    }

    /// Both sides of every history become zero.
    fn clear_histories(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) {
        for resource in self.plan.resources.iter().filter(|resource| resource.history) {
            for slot in &resource.slots {
                match &self.slots[*slot] {
                    SlotHandle::Texture(texture) => clear_texture(gpu, encoder, texture),
                    SlotHandle::Buffer(buffer) => encoder.clear_buffer(buffer, 0, None),
                }
            }
        }
    }

    /// Parts of a kept resource after the last frame.
    fn kept_parts(&self, name: &str) -> Result<(&PlannedResource, PartSet), RunError> {
        let kept = || {
            let names = self.plan.resources.iter().filter(|resource| resource.kept).map(|resource| resource.name.as_str());
            names.collect::<Vec<_>>().join(", ")
        };
        let found = self.plan.find(name).map(|index| &self.plan.resources[index]).filter(|resource| resource.kept);
        let resource = found.ok_or_else(|| RunError::Undeclared { pass: "the caller".into(), resource: name.into(), declared: kept() })?;
        let side = self.frame.wrapping_sub(1) as usize % 2 % self.sides;
        Ok((resource, self.parts(resource, side, Access::Read)))
    }

    /// A kept resource as its own type, to use its views in another wgpu program. What is in proportion to light is stored times
    /// [`World::pre_exposure`].
    pub fn resource<R: Resource>(&self, name: &str) -> Result<R, RunError> {
        let (resource, parts) = self.kept_parts(name)?;
        let shape = resource.shape.as_ref().as_any().downcast_ref::<R::Shape>();
        let shape = shape
            .filter(|_| resource.type_name == R::NAME)
            .ok_or_else(|| RunError::Pass { pass: name.into(), message: format!("it is {}, not {}", resource.type_name, R::NAME) })?;
        Ok(R::assemble(shape, &parts))
    }

    /// Reads all parts of a kept resource back: name, description, and data. What [`Part::light`] names is divided by [`World::pre_exposure`]; half floats
    /// come as 32-bit floats where that is not 1.
    pub fn read(&self, gpu: &Gpu, name: &str) -> Result<Vec<(Part, PartData)>, RunError> {
        let (resource, parts) = self.kept_parts(name)?;
        let mut read = Vec::new();
        for (part, (_, handle)) in resource.parts.iter().zip(parts.iter()) {
            let data = match handle {
                PartHandle::Texture(texture) => {
                    let layers = (0..texture.shape().layers).map(|layer| gpu.read_texture(texture.texture(), 0, layer));
                    let layers = layers.map(|layer| layer.map(|data| data.without_pre_exposure(part.light, self.pre_exposure)));
                    PartData::Texture(layers.collect::<Result<_, GpuError>>()?)
                }
                PartHandle::Buffer(buffer) => {
                    let mut bytes = gpu.read_buffer(buffer.buffer())?;
                    remove_pre_exposure(&mut bytes, part, self.pre_exposure);
                    PartData::Buffer(bytes)
                }
            };
            read.push((part.clone(), data));
        }
        Ok(read)
    }

    /// Overwrites the first image part of a kept resource with linear RGB (alpha 1), row 0 at the top; formats `rgba16float` and `rgba32float`. Units are those
    /// of [`Runner::read`].
    pub fn write_image(&self, gpu: &Gpu, name: &str, pixels: &[[f32; 3]]) -> Result<(), RunError> {
        let (resource, parts) = self.kept_parts(name)?;
        let refuse = |message: &str| RunError::Pass { pass: name.into(), message: message.into() };
        let texture = resource.parts.iter().zip(parts.iter()).find_map(|(part, (_, handle))| match handle {
            PartHandle::Texture(texture) => Some((part, texture.clone())),
            PartHandle::Buffer(_) => None,
        });
        let (part, texture) = texture.ok_or_else(|| refuse("it has no image"))?;
        let stored = |channel: usize| if part.light >> channel & 1 == 1 { self.pre_exposure } else { 1.0 };
        let factors = [stored(0), stored(1), stored(2)];
        let texels = pixels.iter().flat_map(|[r, g, b]| [*r * factors[0], *g * factors[1], *b * factors[2], 1.0]);
        let [width, height] = texture.shape().extent;
        if pixels.len() != width as usize * height as usize {
            return Err(refuse("the image has another size"));
        }
        let (bytes, texel): (Vec<u8>, u32) = match texture.shape().format {
            wgpu::TextureFormat::Rgba16Float => {
                let half = |value: f32| half::f16::from_f32(value.clamp(-65504.0, 65504.0)).to_le_bytes();
                (texels.flat_map(half).collect(), 8)
            }
            wgpu::TextureFormat::Rgba32Float => (texels.flat_map(f32::to_le_bytes).collect(), 16),
            _ => return Err(refuse("its format cannot be written")),
        };
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * texel), rows_per_image: Some(height) };
        gpu.queue().write_texture(texture.texture().as_image_copy(), &bytes, layout, size);
        gpu.take_error()?;
        Ok(())
    }

    /// Records and submits once more only the pass that makes `name`, on what its inputs hold now. Its inputs must be kept.
    pub fn rerun_maker(&mut self, gpu: &Gpu, world: &W::Device, name: &str, seed: u32) -> Result<(), RunError> {
        let unknown = || RunError::Undeclared { pass: "the caller".into(), resource: name.into(), declared: String::new() };
        let index = self.plan.find(name).ok_or_else(unknown)?;
        let position = self.plan.resources[index].maker;
        let previous = self.frame.wrapping_sub(1);
        let side = (previous % 2) as usize % self.sides;
        let mut encoder = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(name) });
        let mut timer = Timer::new(gpu, false);
        let run = &mut self.passes[position];
        let mut frame = Frame {
            gpu,
            encoder: &mut encoder,
            timer: &mut timer,
            pass: &self.plan.passes[position].name,
            info: FrameInfo { index: previous, seed },
            history_valid: self.age > 1,
            progress: &mut |_, _| true,
            connected: &run.connected[side],
            waited: 0.0,
        };
        run.pass.record(&mut frame, world, run.bindings[side].as_ref())?;
        gpu.queue().submit([encoder.finish()]);
        gpu.take_error()?;
        Ok(())
    }

    /// Reads one texture part of a kept resource, first layer.
    pub fn read_image(&self, gpu: &Gpu, name: &str) -> Result<TextureData, RunError> {
        let images = self.read(gpu, name)?.into_iter().filter_map(|(_, data)| match data {
            PartData::Texture(layers) => layers.into_iter().next(),
            PartData::Buffer(_) => None,
        });
        images.into_iter().next().ok_or_else(|| RunError::Pass { pass: name.into(), message: "it has no image".into() })
    }
}

/// What [`Runner::read`] brings back.
#[derive(Clone, Debug)]
pub enum PartData {
    /// One image per layer.
    Texture(Vec<TextureData>),
    /// Raw bytes.
    Buffer(Vec<u8>),
}

/// Divides the words of a buffer of records that are in proportion to light.
fn remove_pre_exposure(bytes: &mut [u8], part: &Part, pre_exposure: f32) {
    let Values::Records { stride, .. } = part.values else { return };
    if part.light == 0 || pre_exposure == 1.0 {
        return;
    }
    for (index, word) in bytes.chunks_exact_mut(4).enumerate() {
        if part.light >> (index % stride as usize) & 1 == 1 {
            let value = f32::from_le_bytes([word[0], word[1], word[2], word[3]]) / pre_exposure;
            word.copy_from_slice(&value.to_le_bytes());
        }
    }
}

fn safety_net(error: crate::error::BuildError) -> RunError {
    RunError::Pass { pass: "safety net".into(), message: error.to_string() }
}

fn allocate<W: World>(gpu: &Gpu, plan: &Plan<W>, slot: &crate::plan::Slot) -> SlotHandle {
    let users = slot.users.iter().map(|(resource, part)| format!("{}/{part}", plan.resources[*resource].name));
    let label = users.collect::<Vec<_>>().join(", ");
    match &slot.kind {
        PartKind::Texture(shape) => SlotHandle::Texture(gpu.device().create_texture(&wgpu::TextureDescriptor {
            label: Some(&label),
            size: wgpu::Extent3d { width: shape.extent[0], height: shape.extent[1], depth_or_array_layers: shape.layers },
            mip_level_count: shape.mips,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: shape.format,
            usage: shape.usage | wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        })),
        PartKind::Buffer(shape) => SlotHandle::Buffer(gpu.device().create_buffer(&wgpu::BufferDescriptor {
            label: Some(&label),
            size: shape.bytes,
            usage: shape.usage | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })),
    }
}

/// Clearing a texture outright is an optional feature; writing zeros, or clearing a depth attachment, works everywhere.
fn clear_texture(gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, texture: &wgpu::Texture) {
    let (layers, format) = (texture.depth_or_array_layers(), texture.format());
    for mip in 0..texture.mip_level_count() {
        let [width, height] = [(texture.width() >> mip).max(1), (texture.height() >> mip).max(1)];
        for layer in 0..layers {
            if format.is_depth_stencil_format() {
                let view = texture.create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(wgpu::TextureViewDimension::D2),
                    base_array_layer: layer,
                    array_layer_count: Some(1),
                    base_mip_level: mip,
                    mip_level_count: Some(1),
                    ..Default::default()
                });
                let depth_ops = Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store });
                let _ = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label: Some("clear history"),
                    depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment { view: &view, depth_ops, stencil_ops: None }),
                    ..Default::default()
                });
            } else {
                let pitch = width * format.block_copy_size(None).unwrap_or(4);
                gpu.queue().write_texture(
                    wgpu::TexelCopyTextureInfo {
                        texture,
                        mip_level: mip,
                        origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                        aspect: wgpu::TextureAspect::All,
                    },
                    &vec![0; pitch as usize * height as usize],
                    wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(pitch), rows_per_image: Some(height) },
                    wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                );
            }
        }
    }
}

fn flush(gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, timer: &mut Timer) -> Result<(), GpuError> {
    let next = gpu.device().create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("lobelia frame") });
    timer.resolve(encoder);
    gpu.queue().submit([std::mem::replace(encoder, next).finish()]);
    gpu.wait()
}

fn poison<W: World>(
    checker: &Checker,
    encoder: &mut wgpu::CommandEncoder,
    plan: &Plan<W>,
    pass: &PlannedPass<W>,
    slots: &[SlotHandle],
    side: usize,
) {
    for index in &pass.outputs {
        let resource = &plan.resources[*index];
        let offset = if resource.history { side * resource.parts.len() } else { 0 };
        for (part_index, part) in resource.parts.iter().enumerate() {
            match (&slots[resource.slots[offset + part_index]], &part.kind) {
                (SlotHandle::Texture(texture), PartKind::Texture(shape)) => checker.poison_texture(encoder, texture, shape),
                (SlotHandle::Buffer(buffer), _) => checker.poison_buffer(encoder, buffer),
                (SlotHandle::Texture(_), PartKind::Buffer(_)) => {}
            }
        }
    }
}

fn count<W: World>(
    checker: &mut Checker,
    gpu: &Gpu,
    encoder: &mut wgpu::CommandEncoder,
    plan: &Plan<W>,
    pass: &PlannedPass<W>,
    connected: &Connected,
) -> Result<(), RunError> {
    for index in &pass.outputs {
        let resource = &plan.resources[*index];
        let Some(parts) = connected.parts(&resource.name) else { continue };
        for (part, (_, handle)) in resource.parts.iter().zip(parts.iter()) {
            if part.values != Values::Any {
                checker
                    .count(gpu, encoder, handle, part.values, &pass.name, &format!("{}/{}", resource.name, part.name))
                    .map_err(safety_net)?;
            }
        }
    }
    Ok(())
}
