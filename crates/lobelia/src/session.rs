//! From scene and graph to a picture.

use glam::DVec2;
use lobelia_frame::{DisplayImage, Radiance, SceneWorld};
use lobelia_graph::{FrameReport, Gpu, GpuError, GpuOptions, Plan, PlanOptions, Problems, Resource, RunError, RunOptions, Runner, Wired};
use lobelia_measure::Image;
use lobelia_scene::{
    Camera, LoadOptions, Ndf, Scene, SceneError,
    device::{GpuScene, ViewUniform},
};
use std::sync::Arc;

/// Why a session could not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// The graph, or the graph on this scene.
    #[error(transparent)]
    Graph(#[from] Problems),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Running.
    #[error(transparent)]
    Run(#[from] RunError),
    /// An argument.
    #[error("{0}")]
    Argument(String),
    /// A file that could not be written.
    #[error("{0}")]
    Write(String),
}

impl SessionError {
    /// Whether the input is at fault (exit code 2) and not the run (exit code 1).
    pub fn is_bad_input(&self) -> bool {
        matches!(self, SessionError::Scene(_) | SessionError::Graph(_) | SessionError::Argument(_))
    }
}

/// Most pixels along a side of a picture: WebGPU's default limit on textures.
pub const MAX_SIDE: u32 = 8192;

/// How a session is opened.
#[derive(Clone, Debug, Default)]
pub struct SessionOptions {
    /// Part of an adapter's name; `None` takes the best.
    pub adapter: Option<String>,
    /// Only what every WebGPU device has: no optional features, default limits.
    pub baseline: bool,
    /// Overrides the scene's normal distribution function.
    pub ndf: Option<Ndf>,
    /// Time of animations in seconds.
    pub time: f32,
    /// How a scene file is loaded.
    pub load: LoadOptions,
}

/// One picture to take.
#[derive(Clone, Debug)]
pub struct Shot {
    /// Width and height in pixels.
    pub extent: [u32; 2],
    /// Camera name; `None` takes the scene's first.
    pub camera: Option<String>,
    /// Sub-pixel-jittered frames that are averaged in linear radiance, >= 1. One frame samples pixel centres.
    pub samples: u32,
    /// Groups in which samples are summed as well, sample `s` in group `s` modulo this; 1 for none. See [`Rendering::groups`].
    pub groups: u32,
    /// Frames to run, >= 1; the last is the picture. More than one lets histories settle and steadies the times.
    pub frames: u32,
    /// Seconds between frames of an animated scene.
    pub frame_seconds: f32,
    /// Frames are samples of one picture: each has a seed and sub-pixel offsets of its own, and animations stand still. Without, every frame draws
    /// the same numbers, so that frames differ by what moves alone.
    pub progressive: bool,
    /// Every frame has a seed of its own, as a technique that is filtered over time would want it; sub-pixel offsets stay those of the first.
    pub new_seeds: bool,
    /// Seed of everything random.
    pub seed: u32,
    /// Further resources to keep: `pass.port`.
    pub keep: Vec<String>,
    /// Specialise and prune to the scene; `false` is the yardstick.
    pub specialise: bool,
    /// Poison and count (slow), and how time is taken.
    pub run: RunOptions,
}

impl Default for Shot {
    fn default() -> Self {
        Self {
            extent: [960, 540],
            camera: None,
            samples: 1,
            groups: 1,
            frames: 1,
            frame_seconds: 1.0 / 24.0,
            progressive: false,
            new_seeds: false,
            seed: 0,
            keep: Vec::new(),
            specialise: true,
            run: RunOptions::default(),
        }
    }
}

impl Shot {
    /// Options for planning this shot.
    pub fn plan_options(&self) -> PlanOptions {
        PlanOptions { keep: self.keep.clone(), specialise: self.specialise, ..PlanOptions::new(self.extent) }
    }
}

/// How far a rendering is.
#[derive(Clone, Debug)]
pub struct Step {
    /// Frame, from 0.
    pub frame: u32,
    /// Sample within the frame, from 0.
    pub sample: u32,
    /// Pass with long work, and how much of it is done in [0, 1].
    pub pass: Option<(String, f32)>,
}

/// What a graph made.
#[derive(Clone, Debug)]
pub struct Picture {
    /// Width and height in pixels.
    pub extent: [u32; 2],
    /// Linear RGB: the output, or, where the output is a display image, the radiance that it shows. Row 0 at the top. Empty if the output is neither.
    pub pixels: Vec<[f32; 3]>,
    /// sRGB-encoded RGBA for a display, if the output is a display image.
    pub display: Option<Vec<u8>>,
}

impl Picture {
    /// The linear part as an image that can be measured and saved.
    pub fn image(&self) -> Image {
        Image { width: self.extent[0] as usize, height: self.extent[1] as usize, pixels: self.pixels.clone() }
    }
}

/// A device and a scene on it.
pub struct Session {
    gpu: Gpu,
    scene: Arc<Scene>,
    device: GpuScene,
    time: f32,
}

impl Session {
    /// Loads a scene (a path, or `builtin:NAME`) and puts it on a device.
    pub fn new(address: &str, options: &SessionOptions) -> Result<Self, SessionError> {
        let scene = Self::load(address, options)?;
        let gpu = Gpu::new(&GpuOptions { adapter: options.adapter.clone(), baseline: options.baseline })?;
        Self::with(gpu, scene, options.time)
    }

    /// Loads a scene as [`Session::new`] does, without a device.
    pub fn load(address: &str, options: &SessionOptions) -> Result<Scene, SessionError> {
        if !options.time.is_finite() {
            return Err(SessionError::Argument(format!("--time is {}, but must be finite", options.time)));
        }
        let mut scene = Scene::load_with(address, &options.load)?;
        if let Some(ndf) = options.ndf {
            scene.ndf = ndf;
        }
        scene.set_time(options.time);
        Ok(scene)
    }

    /// Puts a scene on a device that the caller has.
    pub fn with(gpu: Gpu, scene: Scene, time: f32) -> Result<Self, SessionError> {
        let scene = Arc::new(scene);
        let device = GpuScene::new(gpu.device(), gpu.queue(), scene.clone())?;
        gpu.take_error()?;
        Ok(Self { gpu, scene, device, time })
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The scene on the device.
    pub fn device(&self) -> &GpuScene {
        &self.device
    }

    /// Plans a graph for the scene and creates everything that it needs.
    pub fn start(&mut self, wired: &Wired<SceneWorld>, shot: &Shot) -> Result<Rendering<'_>, SessionError> {
        if shot.extent.contains(&0) || shot.extent.iter().any(|side| *side > MAX_SIDE) {
            return Err(SessionError::Argument(format!(
                "a picture of {}x{} pixels cannot be made; each side must lie in [1, {MAX_SIDE}]",
                shot.extent[0], shot.extent[1]
            )));
        }
        if shot.samples == 0 || shot.frames == 0 {
            return Err(SessionError::Argument("--samples and --frames must be at least 1".into()));
        }
        let camera = self.scene.camera(shot.camera.as_deref())?.clone();
        let mut options = shot.plan_options();
        let mut plan = wired.plan(&self.scene.traits(), &options)?;
        // Where the graph ends in a display image, the radiance behind it is kept too: samples are averaged there.
        let shown = shown_radiance(&plan);
        if let Some(radiance) = &shown {
            options.keep.push(radiance.clone());
            plan = wired.plan(&self.scene.traits(), &options)?;
        }
        let output = plan.resources[plan.output].name.clone();
        let linear = match (&shown, plan.resources[plan.output].type_name) {
            (Some(radiance), _) => Some(radiance.clone()),
            (None, name) if name == Radiance::NAME => Some(output.clone()),
            _ => None,
        };
        let runner = Runner::new(&self.gpu, plan, &self.device, shot.run)?;
        Ok(Rendering {
            session: self,
            runner,
            shot: shot.clone(),
            camera,
            output,
            shown,
            linear,
            sums: Vec::new(),
            reports: Vec::new(),
            view: None,
            centre: mean_of_spread(if shot.progressive { shot.frames.saturating_mul(shot.samples) } else { shot.samples }),
        })
    }
}

/// The radiance that a display image shows, by name.
fn shown_radiance(plan: &Plan<SceneWorld>) -> Option<String> {
    let output = &plan.resources[plan.output];
    if output.type_name != DisplayImage::NAME {
        return None;
    }
    let inputs = plan.passes[output.maker].inputs.iter().flatten();
    let radiance = inputs.map(|index| &plan.resources[*index]).find(|resource| resource.type_name == Radiance::NAME)?;
    Some(radiance.name.clone())
}

/// Time of a frame of a shot that begins at `start`, seconds.
pub fn frame_time(start: f32, shot: &Shot, frame: u32) -> f32 {
    start + frame as f32 * shot.frame_seconds
}

/// A sum over samples of one radiance image.
struct Sum {
    name: String,
    total: Vec<[f64; 3]>,
    /// One for each group of samples, if there are several.
    groups: Vec<Vec<[f32; 3]>>,
}

/// A graph that is being rendered.
pub struct Rendering<'a> {
    session: &'a mut Session,
    runner: Runner<SceneWorld>,
    shot: Shot,
    camera: Camera,
    output: String,
    shown: Option<String>,
    linear: Option<String>,
    sums: Vec<Sum>,
    reports: Vec<FrameReport>,
    view: Option<ViewUniform>,
    /// Taken from sub-pixel positions to centre them.
    centre: DVec2,
}

/// Point `index` of the R2 sequence (Roberts 2018), in [0, 1)^2.
fn spread(index: u32) -> DVec2 {
    (DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_3) * f64::from(index + 1)).fract()
}

/// Mean of the first `samples` points. Sub-pixel offsets are points minus this, so that their mean is the pixel's centre; a single sample lies there.
fn mean_of_spread(samples: u32) -> DVec2 {
    (0..samples).map(spread).sum::<DVec2>() / f64::from(samples.max(1))
}

impl Rendering<'_> {
    /// The plan that is run.
    pub fn plan(&self) -> &Plan<SceneWorld> {
        self.runner.plan()
    }

    /// The runner, to read kept resources from.
    pub fn runner(&self) -> &Runner<SceneWorld> {
        &self.runner
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        &self.session.gpu
    }

    /// What light is multiplied by on the device: [`GpuScene::pre_exposure`]. Everything that is read back here is without it.
    pub fn pre_exposure(&self) -> f32 {
        self.session.device.pre_exposure()
    }

    /// The scene at the moment of the last frame.
    pub fn scene(&self) -> &Scene {
        &self.session.scene
    }

    /// The camera of the last frame.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// What is rendered.
    pub fn shot(&self) -> &Shot {
        &self.shot
    }

    /// The view of the last sample; none before the first.
    pub fn view(&self) -> Option<&ViewUniform> {
        self.view.as_ref()
    }

    /// `pass.port` of the radiance that the graph ends in, or that its display image shows; `None` where it ends in something else.
    pub fn linear_output(&self) -> Option<String> {
        self.linear.clone()
    }

    /// What each frame took so far.
    pub fn reports(&self) -> &[FrameReport] {
        &self.reports
    }

    /// Runs all frames and samples; `step` hears how far it is and stops it by returning `false`.
    pub fn run(&mut self, step: &mut dyn FnMut(&Step) -> bool) -> Result<Picture, SessionError> {
        self.run_frames(step, &mut |_| Ok(()))?;
        self.picture(false)
    }

    /// As [`Rendering::run`]; `seen` is called after every frame, while what it made can be read.
    pub fn run_frames(
        &mut self,
        step: &mut dyn FnMut(&Step) -> bool,
        seen: &mut dyn FnMut(&Self) -> Result<(), SessionError>,
    ) -> Result<(), SessionError> {
        self.runner.reset_history();
        for frame in 0..self.shot.frames {
            self.frame(frame, step)?;
            seen(self)?;
        }
        Ok(())
    }

    /// As [`Rendering::run`], with a picture of every frame: `each` gets it while everything else that the frame made can be read.
    pub fn run_each<E: From<SessionError>>(
        &mut self,
        step: &mut dyn FnMut(&Step) -> bool,
        each: &mut dyn FnMut(&Self, u32, Picture) -> Result<(), E>,
    ) -> Result<(), E> {
        self.runner.reset_history();
        for frame in 0..self.shot.frames {
            self.frame(frame, step)?;
            let picture = self.picture(frame + 1 < self.shot.frames)?;
            each(self, frame, picture)?;
        }
        Ok(())
    }

    fn frame(&mut self, frame: u32, step: &mut dyn FnMut(&Step) -> bool) -> Result<(), SessionError> {
        self.advance(frame);
        self.sums = self.radiances().into_iter().map(|name| Sum { name, total: Vec::new(), groups: Vec::new() }).collect();
        (0..self.shot.samples).try_for_each(|sample| self.sample(frame, sample, step))
    }

    /// Moves an animated scene on.
    fn advance(&mut self, frame: u32) {
        if self.shot.progressive || self.shot.frames == 1 || !self.session.scene.traits().animated {
            return;
        }
        let mut scene = Scene::clone(&self.session.scene);
        scene.set_time(frame_time(self.session.time, &self.shot, frame));
        // A camera may hang below a node that moves.
        if let Ok(camera) = scene.camera(self.shot.camera.as_deref()) {
            self.camera = camera;
        }
        self.session.scene = Arc::new(scene);
        let queue = self.session.gpu.queue();
        self.session.device.update(queue, self.session.scene.clone());
    }

    fn sample(&mut self, frame: u32, sample: u32, step: &mut dyn FnMut(&Step) -> bool) -> Result<(), SessionError> {
        if !step(&Step { frame, sample, pass: None }) {
            return Err(RunError::Stopped.into());
        }
        let session = &*self.session;
        let index = frame.wrapping_mul(self.shot.samples).wrapping_add(sample);
        let draw = if self.shot.progressive { index } else { sample };
        let jitter = (spread(draw) - self.centre).as_vec2();
        // Every sample has its own random numbers; the first has the seed itself.
        let draw = if self.shot.new_seeds { index } else { draw };
        let seed = self.shot.seed.wrapping_add(draw.wrapping_mul(0x9e37_79b9));
        let view = ViewUniform::new(&self.camera, session.scene.origin(), self.shot.extent, jitter, index, seed, self.view.as_ref());
        session.device.set_view(session.gpu.queue(), &view);
        self.view = Some(view);
        let mut progress = |pass: &str, done: f32| step(&Step { frame, sample, pass: Some((pass.to_owned(), done)) });
        let report = self.runner.run(&session.gpu, &session.device, seed, &mut progress)?;
        self.reports.push(report);
        if self.shot.samples > 1 {
            for sum in &mut self.sums {
                let pixels = self.runner.read_image(&session.gpu, &sum.name)?.to_f32_rgba();
                sum.total.resize(pixels.len(), [0.0; 3]);
                for (total, pixel) in sum.total.iter_mut().zip(&pixels) {
                    for channel in 0..3 {
                        total[channel] += f64::from(pixel[channel]);
                    }
                }
                if self.shot.groups > 1 {
                    sum.groups.resize(self.shot.groups as usize, Vec::new());
                    let group = &mut sum.groups[(sample % self.shot.groups) as usize];
                    group.resize(pixels.len(), [0.0; 3]);
                    for (total, pixel) in group.iter_mut().zip(&pixels) {
                        for channel in 0..3 {
                            total[channel] += pixel[channel];
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Kept radiances, the shown one first.
    fn radiances(&self) -> Vec<String> {
        let kept = self.plan().resources.iter().filter(|resource| resource.kept && resource.type_name == Radiance::NAME);
        kept.map(|resource| resource.name.clone()).collect()
    }

    /// A kept radiance: the average over samples, or the only frame.
    pub fn radiance(&self, name: &str) -> Result<Image, SessionError> {
        let resolved = self.plan().find(name).map_or(name, |index| self.plan().resources[index].name.as_str());
        let [width, height] = self.shot.extent.map(|side| side as usize);
        let pixels = match self.sums.iter().find(|sum| sum.name == resolved && !sum.total.is_empty()) {
            Some(sum) => {
                let scale = 1.0 / f64::from(self.shot.samples);
                sum.total.iter().map(|total| total.map(|value| (value * scale) as f32)).collect()
            }
            None => {
                let pixels = self.runner.read_image(&self.session.gpu, resolved)?.to_f32_rgba();
                pixels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect()
            }
        };
        Ok(Image { width, height, pixels })
    }

    /// Means of the groups of samples of a kept radiance, each with its share of the samples; empty without groups ([`Shot::groups`]).
    pub fn groups(&self, name: &str) -> Vec<(f64, Image)> {
        let resolved = self.plan().find(name).map_or(name, |index| self.plan().resources[index].name.as_str());
        let [width, height] = self.shot.extent.map(|side| side as usize);
        let groups = self.sums.iter().find(|sum| sum.name == resolved).map_or(&[][..], |sum| &sum.groups);
        let (samples, count) = (self.shot.samples, self.shot.groups);
        let mean = |(index, group): (u32, &Vec<[f32; 3]>)| {
            let size = samples / count + u32::from(index < samples % count);
            let pixels = group.iter().map(|total| total.map(|value| value / size as f32)).collect();
            (f64::from(size) / f64::from(samples), Image { width, height, pixels })
        };
        (0..count).zip(groups).map(mean).collect()
    }

    /// Chooses other random numbers for what is run from now on.
    pub fn set_seed(&mut self, seed: u32) {
        self.shot.seed = seed;
    }

    /// The picture of the frame that was run. Where more frames follow, they find the radiance as the last sample left it.
    fn picture(&mut self, more_follow: bool) -> Result<Picture, SessionError> {
        // An output that is neither radiance nor a display image has no picture; `--save` writes it.
        let Some(linear) = self.linear.clone() else {
            return Ok(Picture { extent: self.shot.extent, pixels: Vec::new(), display: None });
        };
        let image = self.radiance(&linear)?;
        let mut display = None;
        if self.shown.is_some() {
            if self.shot.samples > 1 {
                // The display image shows the average: the averaged radiance is put back and only its last pass runs again.
                let last = if more_follow { Some(self.runner.read_image(&self.session.gpu, &linear)?.to_f32_rgba()) } else { None };
                self.runner.write_image(&self.session.gpu, &linear, &image.pixels)?;
                self.runner.rerun_maker(&self.session.gpu, &self.session.device, &self.output, self.shot.seed)?;
                if let Some(last) = last {
                    let last: Vec<[f32; 3]> = last.into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
                    self.runner.write_image(&self.session.gpu, &linear, &last)?;
                }
            }
            display = Some(self.runner.read_image(&self.session.gpu, &self.output)?.bytes);
        }
        Ok(Picture { extent: self.shot.extent, pixels: image.pixels, display })
    }
}

#[cfg(test)]
mod tests {
    use super::{mean_of_spread, spread};
    use glam::Vec2;

    #[test]
    fn samples_are_centred_and_spread() {
        let of = |samples: u32| -> Vec<Vec2> { (0..samples).map(|index| (spread(index) - mean_of_spread(samples)).as_vec2()).collect() };
        assert_eq!(of(1), [Vec2::ZERO]);
        for samples in [2, 3, 16, 64] {
            let offsets = of(samples);
            let mean = offsets.iter().sum::<Vec2>() / samples as f32;
            assert!(mean.length() < 1e-6, "{samples}: {mean}");
            assert!(offsets.iter().all(|offset| offset.abs().max_element() < 0.75), "{offsets:?}");
            assert!(offsets.iter().any(|offset| offset.x > 0.1) && offsets.iter().any(|offset| offset.y < -0.1));
        }
    }
}
