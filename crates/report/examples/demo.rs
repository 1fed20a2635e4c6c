//! Writes the page of a sweep with made-up numbers, to look at its plots without a device: `cargo run -p lobelia-report --example demo -- FOLDER`.

use std::{collections::BTreeMap, path::PathBuf};

use lobelia_measure::sampled::{Replication, Sampled};
use lobelia_report::{Sweep, SweepRow, VERSION, sweep_page};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = PathBuf::from(std::env::args().nth(1).ok_or("name a folder")?);
    std::fs::create_dir_all(&folder)?;
    std::fs::write(folder.join("sweep.html"), sweep_page(&sweep()))?;
    Ok(())
}

fn sweep() -> Sweep {
    let mut rows = Vec::new();
    for (scene, difficulty) in [("warm wall", 1.0), ("hall", 6.0), ("yard", 0.2)] {
        for (variant, speed, floor) in [("clustered", 1.0, 0.004), ("hierarchical", 0.55, 0.02), ("brute force", 3.0, 0.0005)] {
            for step in 0..5u32 {
                for seed in 0..2u64 {
                    let lobes = 16.0 * 4.0f64.powi(step as i32);
                    let wobble = 1.0 + 0.06 * (seed as f64 - 0.5);
                    let (ms, error) = ((0.4 + speed * lobes / 300.0) * wobble, difficulty * (floor + 0.6 / lobes) / wobble);
                    let failed = variant == "brute force" && step == 4 && scene == "hall";
                    rows.push(SweepRow {
                        scene: scene.to_owned(),
                        variant: variant.to_owned(),
                        parameters: BTreeMap::from([("gather.lobes".to_owned(), (lobes as u32).into())]),
                        seed,
                        ms: if failed { f64::NAN } else { ms },
                        round_ms: [0.98, 1.01, 1.02, 0.99].map(|factor| factor * ms).to_vec(),
                        error: (!failed).then_some(Sampled {
                            value: error,
                            replicates: [0.93, 1.05, 1.04, 0.97, 1.03].map(|factor| factor * error).to_vec(),
                            replication: Replication::Repeats,
                        }),
                        floor: Some(0.002 * difficulty),
                        failed: failed.then(|| "the device was lost: out of memory for 4096 lobes".to_owned()),
                    });
                }
            }
        }
    }
    Sweep {
        light: Vec::new(),
        version: VERSION,
        title: "Lobes against error and time".to_owned(),
        devices: vec!["Made-up device, driver 1.2.3".to_owned()],
        rows,
        metric: "relative_mse".to_owned(),
        target_error: Some(0.02),
        target_ms: Some(2.0),
    }
}
