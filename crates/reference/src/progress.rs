//! A picture that grows: passes over all pixels, its estimated error, checkpoints.

use crate::{
    path::{LightPaths, Wanted, World},
    sampler::Sampler,
};
use glam::DVec3;
use lobelia_scene::{Camera, Scene};
use rayon::prelude::*;
use std::{
    io::{self, Read as _, Write as _},
    path::{Path, PathBuf},
};

/// Samples per pixel of one pass, unless fewer are wanted in all. A power of two, over which the points are best spread.
pub const PASS_SAMPLES: u64 = 16;

/// What to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Which light.
    pub paths: LightPaths,
    /// Samples per pixel, at least 1; rounded up to whole passes of [`PASS_SAMPLES`].
    pub samples: u64,
    /// Chooses the noise. The same seed gives the same picture, bit for bit.
    pub seed: u32,
}

/// Why a reference could not be rendered or kept.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// Settings out of range.
    #[error("{0}")]
    Settings(String),
    /// A file that could not be read or written.
    #[error("{}: {source}", file.display())]
    File {
        /// Which.
        file: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// A checkpoint of something else, or a broken one.
    #[error("{}: {what}", file.display())]
    Checkpoint {
        /// Which.
        file: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

/// A picture and how far it can be trusted.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Linear radiance, row 0 at the top.
    pub pixels: Vec<[f32; 3]>,
    /// Variance of each pixel's value, from the spread of its passes; 0 while there is one pass only.
    pub variance: Vec<[f32; 3]>,
    /// Samples per pixel.
    pub samples: u64,
    /// Samples that were not finite and so left out; none are expected.
    pub dropped: u64,
}

impl Picture {
    /// Mean over pixels and channels of `variance / (value^2 + (0.1 mean)^2)`: the relative mean squared error that noise alone makes.
    pub fn relative_noise(&self) -> f64 {
        let values = || self.pixels.as_flattened().iter().map(|value| f64::from(*value));
        let count = (3 * self.pixels.len()) as f64;
        let mean = values().sum::<f64>() / count;
        let floor = (0.1 * mean).powi(2).max(f64::MIN_POSITIVE);
        values().zip(self.variance.as_flattened()).map(|(value, variance)| f64::from(*variance) / (value * value + floor)).sum::<f64>()
            / count
    }
}

/// Sums over the passes so far.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    key: [u8; 32],
    passes: u64,
    dropped: u64,
    /// Per pixel: sums of the passes' means, and of their squares.
    sums: Vec<[f64; 6]>,
}

const MAGIC: &[u8; 16] = b"lobelia-path-001";

impl Checkpoint {
    /// Reads a checkpoint.
    pub fn load(file: &Path) -> Result<Self, ReferenceError> {
        let fail = |source| ReferenceError::File { file: file.into(), source };
        let broken = |what: &str| ReferenceError::Checkpoint { file: file.into(), what: what.into() };
        let mut bytes = Vec::new();
        std::fs::File::open(file).map_err(fail)?.read_to_end(&mut bytes).map_err(fail)?;
        let (Some(magic), Some(key), Some(counts)) = (bytes.get(..16), bytes.get(16..48), bytes.get(48..64)) else {
            return Err(broken("this is no checkpoint: it is too short"));
        };
        if magic != MAGIC {
            return Err(broken("this is no checkpoint of this version"));
        }
        let rest = &bytes[64..];
        if rest.len() % 48 != 0 {
            return Err(broken("the checkpoint is cut short"));
        }
        let number = |bytes: &[u8]| u64::from_le_bytes(bytes.try_into().unwrap_or_default());
        let sums =
            rest.chunks_exact(48).map(|pixel| std::array::from_fn(|at| f64::from_bits(number(&pixel[8 * at..8 * at + 8])))).collect();
        Ok(Self { key: key.try_into().unwrap_or_default(), passes: number(&counts[..8]), dropped: number(&counts[8..]), sums })
    }

    /// Writes it beside its final place and moves it there, so that a file is whole or absent.
    pub fn save(&self, file: &Path) -> Result<(), ReferenceError> {
        let mut bytes = Vec::with_capacity(64 + 48 * self.sums.len());
        bytes.extend(MAGIC);
        bytes.extend(self.key);
        bytes.extend(self.passes.to_le_bytes());
        bytes.extend(self.dropped.to_le_bytes());
        bytes.extend(self.sums.as_flattened().iter().flat_map(|sum| sum.to_le_bytes()));
        lobelia_base::replace_file(file, |out| out.write_all(&bytes).map_err(|error| error.to_string()))
            .map_err(|error| ReferenceError::File { file: file.into(), source: std::io::Error::other(error.to_string()) })
    }
}

/// A picture in the making.
pub struct Render {
    world: World,
    eye: Eye,
    settings: Settings,
    state: Checkpoint,
}

/// Where rays begin.
#[derive(Clone, Copy, Debug)]
struct Eye {
    position: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
}

impl Eye {
    fn new(scene: &Scene, camera: &Camera, size: [u32; 2]) -> Self {
        let tangent = (0.5 * camera.yfov).tan();
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        Self {
            position: camera.position - scene.origin(),
            forward: camera.forward,
            right: camera.right * (tangent * aspect),
            up: camera.up * tangent,
        }
    }

    /// Unit direction through a point of the picture; (0, 0) is its top left corner, (1, 1) its bottom right one.
    fn direction(&self, x: f64, y: f64) -> DVec3 {
        (self.forward + self.right * (2.0 * x - 1.0) + self.up * (1.0 - 2.0 * y)).normalize()
    }
}

/// Largest picture, pixels.
const MAX_PIXELS: u64 = 1 << 28;

impl Render {
    /// Prepares a scene, at its present moment, seen by a camera.
    pub fn new(scene: &Scene, camera: &Camera, settings: Settings) -> Result<Self, ReferenceError> {
        let pixels = u64::from(settings.size[0]) * u64::from(settings.size[1]);
        if pixels == 0 || pixels > MAX_PIXELS {
            return Err(ReferenceError::Settings(format!(
                "a picture of {} x {} pixels: 1 to {MAX_PIXELS} are possible",
                settings.size[0], settings.size[1]
            )));
        }
        if settings.samples == 0 || settings.samples > u64::from(u32::MAX) {
            return Err(ReferenceError::Settings(format!(
                "{} samples per pixel: at least 1 and at most {} are possible",
                settings.samples,
                u32::MAX
            )));
        }
        // Lights that are only seen directly need no scattering event, but asking for none at all is a mistake.
        let depth = match settings.paths {
            LightPaths::Full { depth } => depth,
            LightPaths::Only(light) => light.depth().map_or(0, |depth| depth.max(1)),
            LightPaths::Direct | LightPaths::OneBounce => 1,
        };
        if !(1..=1000).contains(&depth) {
            return Err(ReferenceError::Settings(format!("a depth of {depth}: 1 to 1000 scattering events are possible")));
        }
        let state = Checkpoint { key: key(scene, camera, &settings), passes: 0, dropped: 0, sums: vec![[0.0; 6]; pixels as usize] };
        Ok(Self { world: World::new(scene), eye: Eye::new(scene, camera, settings.size), settings, state })
    }

    /// Names what the picture is a function of, but for the number of samples: hexadecimal, fit for a file name.
    pub fn key(&self) -> String {
        self.state.key.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Samples per pixel of one pass.
    pub fn pass_samples(&self) -> u64 {
        self.settings.samples.min(PASS_SAMPLES)
    }

    /// Passes that the settings ask for.
    pub fn passes(&self) -> u64 {
        self.settings.samples.div_ceil(self.pass_samples())
    }

    /// Passes so far.
    pub fn done(&self) -> u64 {
        self.state.passes
    }

    /// Adds a pass. The work is spread over the threads of the current rayon pool; the result does not depend on how.
    pub fn step(&mut self) {
        let [width, height] = self.settings.size.map(f64::from);
        let samples = self.pass_samples();
        let first = self.state.passes * samples;
        let (world, eye, settings) = (&self.world, &self.eye, &self.settings);
        let light = Wanted::new(&settings.paths);
        let columns = settings.size[0];
        let dropped = self
            .state
            .sums
            .par_iter_mut()
            .enumerate()
            .with_min_len(16)
            .map(|(pixel, sums)| {
                let (x, y) = (pixel as u32 % columns, pixel as u32 / columns);
                let (mut mean, mut dropped) = (DVec3::ZERO, 0u64);
                for sample in first..first + samples {
                    let mut sampler = Sampler::new(pixel as u32, sample, settings.seed);
                    let [u, v] = sampler.pair();
                    let direction = eye.direction((f64::from(x) + u) / width, (f64::from(y) + v) / height);
                    let radiance = world.radiance(eye.position, direction, &light, &mut sampler);
                    if radiance.is_finite() { mean += radiance } else { dropped += 1 }
                }
                mean /= samples as f64;
                for channel in 0..3 {
                    sums[channel] += mean[channel];
                    sums[3 + channel] += mean[channel] * mean[channel];
                }
                dropped
            })
            .sum::<u64>();
        self.state.dropped += dropped;
        self.state.passes += 1;
    }

    /// The picture so far; black before the first pass.
    pub fn picture(&self) -> Picture {
        let passes = self.state.passes.max(1) as f64;
        let mut picture = Picture {
            size: self.settings.size,
            pixels: Vec::with_capacity(self.state.sums.len()),
            variance: Vec::with_capacity(self.state.sums.len()),
            samples: self.state.passes * self.pass_samples(),
            dropped: self.state.dropped,
        };
        for sums in &self.state.sums {
            picture.pixels.push([0, 1, 2].map(|channel| (sums[channel] / passes) as f32));
            let variance = |channel: usize| {
                let spread = sums[3 + channel] - sums[channel] * sums[channel] / passes;
                if passes > 1.0 { (spread / (passes - 1.0) / passes).max(0.0) as f32 } else { 0.0 }
            };
            picture.variance.push([0, 1, 2].map(variance));
        }
        picture
    }

    /// What is needed to go on later.
    pub fn checkpoint(&self) -> &Checkpoint {
        &self.state
    }

    /// Goes on from a checkpoint of the same scene, camera and settings, whatever their number of samples.
    pub fn resume(&mut self, checkpoint: Checkpoint, file: &Path) -> Result<(), ReferenceError> {
        if checkpoint.key != self.state.key || checkpoint.sums.len() != self.state.sums.len() {
            let what = "the checkpoint is of another scene, camera, size, seed or light paths".to_owned();
            return Err(ReferenceError::Checkpoint { file: file.into(), what });
        }
        self.state = checkpoint;
        Ok(())
    }
}

/// A hash of everything that the picture is a function of, the number of passes aside.
fn key(scene: &Scene, camera: &Camera, settings: &Settings) -> [u8; 32] {
    let mut hasher = blake3::Hasher::new();
    hasher.update(MAGIC);
    for mesh in scene.meshes.iter() {
        hasher.update(&(mesh.positions.len() as u64).to_le_bytes());
        hasher.update(bytemuck::cast_slice(&mesh.positions));
        hasher.update(bytemuck::cast_slice(&mesh.normals));
        hasher.update(bytemuck::cast_slice(&mesh.tangents));
        hasher.update(bytemuck::cast_slice(&mesh.uvs));
        hasher.update(bytemuck::cast_slice(&mesh.second_uvs));
        hasher.update(bytemuck::cast_slice(&mesh.colors));
        hasher.update(bytemuck::cast_slice(&mesh.indices));
        hasher.update(&(mesh.material as u64).to_le_bytes());
    }
    for texture in scene.textures.iter() {
        hasher.update(&texture.width.to_le_bytes());
        hasher.update(&texture.rgba);
    }
    if let Some(sky) = &scene.environment {
        hasher.update(&[sky.width.to_le_bytes(), sky.height.to_le_bytes(), sky.scale.to_le_bytes()].concat());
        hasher.update(bytemuck::cast_slice(&sky.pixels));
    }
    // The rest is small, and its debug text has every digit.
    let rest = format!(
        "{:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {:?} {}",
        scene.instances,
        scene.materials,
        scene.lights,
        scene.area_lights,
        scene.ndf,
        scene.origin(),
        (camera.position, camera.forward, camera.up, camera.yfov),
        settings.size,
        (settings.paths, settings.seed),
        settings.samples.min(PASS_SAMPLES)
    );
    hasher.update(rest.as_bytes());
    *hasher.finalize().as_bytes()
}
