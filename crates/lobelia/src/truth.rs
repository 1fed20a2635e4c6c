//! Path-traced references: grown to a goal, kept on disk, never rendered twice.

use lobelia_measure::Image;
use lobelia_reference::{Checkpoint, Picture, ReferenceError, Render, Settings};
use lobelia_scene::{Camera, Scene};
use std::{
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

/// When a reference is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Samples per pixel; with an error, the most that are taken.
    pub samples: u64,
    /// Estimated relative error: root of the mean of `variance / (value^2 + (0.1 mean)^2)`.
    pub error: Option<f64>,
}

impl Goal {
    /// Samples where neither samples nor error are given.
    pub const SAMPLES: u64 = 256;
    /// The most samples that an error alone may take.
    pub const MOST_SAMPLES: u64 = 1 << 20;

    /// From what a user gives.
    pub fn new(samples: Option<u64>, error: Option<f64>) -> Self {
        Self { samples: samples.unwrap_or(if error.is_some() { Self::MOST_SAMPLES } else { Self::SAMPLES }), error }
    }
}

/// How far a reference is.
#[derive(Clone, Copy, Debug)]
pub struct Growth {
    /// Passes so far.
    pub done: u64,
    /// Passes that are expected, from the error so far where there is a goal for it.
    pub expected: u64,
    /// Samples per pixel so far.
    pub samples: u64,
    /// Estimated relative error, once there are enough passes to say.
    pub error: Option<f64>,
}

/// Where and how often the state of a growing reference is written.
#[derive(Clone, Copy, Debug)]
pub struct Keep<'a> {
    /// File.
    pub file: &'a Path,
    /// Time between two writings.
    pub every: Duration,
}

impl<'a> Keep<'a> {
    /// Every ten seconds.
    pub fn new(file: &'a Path) -> Self {
        Self { file, every: Duration::from_secs(10) }
    }
}

/// The spread of passes says nothing before there are a few of them.
const LEAST: u64 = 4;

/// Whether the error is estimated after this many passes: at fixed ones, so that where a picture stops does not depend on who watches.
fn checks(done: u64) -> bool {
    done >= LEAST && (done.is_power_of_two() || done.is_multiple_of(8))
}

/// Adds passes until the goal is reached, on the threads of the current rayon pool. `step` hears of every pass and stops the work by returning `false`; what is done
/// so far is then in the checkpoint.
pub fn grow(
    render: &mut Render,
    goal: &Goal,
    keep: Option<Keep<'_>>,
    step: &mut dyn FnMut(&Growth) -> bool,
) -> Result<Picture, ReferenceError> {
    let mut saved = Instant::now();
    let mut error = None;
    let mut expected = render.passes();
    loop {
        let done = render.done();
        if checks(done) {
            let estimate = render.picture().relative_noise().sqrt();
            error = Some(estimate);
            if let Some(goal) = goal.error {
                if estimate <= goal {
                    break;
                }
                // To halve the error takes four times the passes.
                expected = ((done as f64 * (estimate / goal).powi(2)).ceil() as u64).clamp(done, render.passes());
            }
        }
        let go_on = step(&Growth { done, expected, samples: done * render.pass_samples(), error });
        let stop = !go_on || done >= render.passes();
        if let Some(keep) = keep
            && done > 0
            && (stop || saved.elapsed() >= keep.every)
        {
            render.checkpoint().save(keep.file)?;
            saved = Instant::now();
        }
        if stop {
            break;
        }
        render.step();
    }
    if let Some(keep) = keep {
        render.checkpoint().save(keep.file)?;
    }
    Ok(render.picture())
}

/// Goes on from a checkpoint if it is there. One that is of something else or broken is an error.
pub fn resume(render: &mut Render, checkpoint: &Path) -> Result<(), ReferenceError> {
    if checkpoint.exists() { render.resume(Checkpoint::load(checkpoint)?, checkpoint) } else { Ok(()) }
}

/// The folder of references that are kept: `LOBELIA_CACHE`, or `lobelia/references` in the user's cache folder.
pub fn cache_folder() -> Option<PathBuf> {
    match std::env::var_os("LOBELIA_CACHE") {
        Some(folder) if !folder.is_empty() => Some(PathBuf::from(folder)),
        _ => dirs::cache_dir().map(|folder| folder.join("lobelia").join("references")),
    }
}

/// A reference and what is known of it.
#[derive(Clone, Debug)]
pub struct Truth {
    /// Linear radiance.
    pub image: Image,
    /// Samples per pixel.
    pub samples: u64,
    /// Relative mean squared error that its own noise makes: differences below about twice this mean nothing.
    pub relative_noise: f64,
    /// Variance of each value of the image.
    pub variance: Vec<[f32; 3]>,
    /// Passes that were already there.
    pub cached_passes: u64,
}

/// The path-traced picture of a scene. It is kept under a hash of scene, camera, size, light paths and seed; what is kept is the state of the path tracer, so that a
/// later call for less noise goes on from there and one for as much or more noise renders nothing. A broken file in the cache is rendered anew.
pub fn truth(
    scene: &Scene,
    camera: &Camera,
    settings: Settings,
    error: Option<f64>,
    cache: Option<&Path>,
    step: &mut dyn FnMut(&Growth) -> bool,
) -> Result<Truth, ReferenceError> {
    let goal = Goal { samples: settings.samples, error };
    let mut render = Render::new(scene, camera, settings)?;
    let file = cache.map(|folder| folder.join(format!("{}.checkpoint", render.key())));
    if let Some(file) = &file {
        if let Some(folder) = file.parent() {
            std::fs::create_dir_all(folder).map_err(|source| ReferenceError::File { file: folder.into(), source })?;
        }
        if resume(&mut render, file).is_err() {
            render = Render::new(scene, camera, settings)?;
        }
    }
    let cached_passes = render.done();
    let enough = cached_passes >= render.passes()
        || (checks(cached_passes) && goal.error.is_some_and(|goal| render.picture().relative_noise().sqrt() <= goal));
    let picture = if enough { render.picture() } else { grow(&mut render, &goal, file.as_deref().map(Keep::new), step)? };
    let relative_noise = picture.relative_noise();
    let [width, height] = settings.size.map(|side| side as usize);
    let image = Image { width, height, pixels: picture.pixels };
    Ok(Truth { image, variance: picture.variance, samples: picture.samples, relative_noise, cached_passes })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use lobelia_reference::LightPaths;

    #[test]
    fn a_reference_is_rendered_once_and_refined_from_where_it_is() {
        let scene = Scene::load("builtin:cornell-diffuse").unwrap();
        let camera = scene.camera(None).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let cache = folder.path().join("deep/cache");
        let of = |samples: u64, error: Option<f64>| {
            let mut steps = 0;
            let settings = Settings { size: [16, 16], paths: LightPaths::Direct, samples, seed: 1 };
            let truth = truth(&scene, &camera, settings, error, Some(&cache), &mut |_| {
                steps += 1;
                true
            });
            (truth.unwrap(), steps)
        };
        let (first, steps) = of(64, None);
        assert!(steps > 0 && first.cached_passes == 0 && first.samples == 64);
        let (again, steps) = of(64, None);
        assert_eq!((again.image, again.cached_passes, steps), (first.image.clone(), 4, 0));
        let (finer, _) = of(128, None);
        assert_eq!((finer.cached_passes, finer.samples), (4, 128));
        // What is already better than asked for stays.
        let (coarse, steps) = of(1 << 16, Some(0.9));
        assert_eq!((coarse.samples, steps), (128, 0));
        // A broken file is no reference.
        let file = std::fs::read_dir(&cache).unwrap().next().unwrap().unwrap().path();
        std::fs::write(&file, "broken").unwrap();
        let (anew, _) = of(64, None);
        assert_eq!((anew.image, anew.cached_passes), (first.image, 0));
    }
}
