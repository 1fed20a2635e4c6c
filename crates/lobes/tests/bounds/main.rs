//! Every bound that the documentation states of an approximation, over the whole of its domain, by random search and hill climbing. `LOBELIA_SEARCH=20000`
//! searches longer than a test should, and `-- --nocapture` prints the table.
#![allow(clippy::unwrap_used)]

mod area;
mod gaussians;
mod others;
mod search;

use search::{Bound, search};

/// Searches all of them; a bound must hold, and be no more than three times what is found, for else it says too little (but for exact forms, whose bound is rounding).
fn check(bounds: &[Bound]) {
    let samples = std::env::var("LOBELIA_SEARCH").ok().and_then(|text| text.parse().ok()).unwrap_or(40);
    println!("| function | domain | compared with | stated | found | at |\n|---|---|---|---:|---:|---|");
    let mut failed = Vec::new();
    for bound in bounds {
        let (found, at) = search(bound, samples, 7);
        println!("| {} | {} | {} | {:.2e} | {found:.2e} | {at:.5?} |", bound.name, bound.domain, bound.reference, bound.stated);
        if found > bound.stated || (bound.stated > 1e-9 && found < bound.stated / 3.0) {
            failed.push(format!("{} over {}: {found:.3e}, stated {:.3e}, at {at:?}", bound.name, bound.domain, bound.stated));
        }
    }
    assert!(failed.is_empty(), "\n{}", failed.join("\n"));
}

#[test]
fn gaussians_are_as_far_off_as_stated() {
    check(&gaussians::bounds());
}

#[test]
fn edges_of_area_lights_are_as_far_off_as_stated() {
    check(&area::bounds());
}

#[test]
fn others_are_as_far_off_as_stated() {
    check(&others::bounds());
}

/// The product of an ASG and an SG by its peak alone, which was this crate's form once and was said to be within 12 %: the search must see that it is not.
#[test]
fn a_bound_that_does_not_hold_is_found() {
    let planted = Bound { error: gaussians::peak_alone, worst: &[], ..gaussians::asg_sg() };
    let (found, at) = search(&planted, 40, 3);
    assert!(found > 0.5, "{found} at {at:?}");
    assert!(std::panic::catch_unwind(|| check(&[Bound { stated: 0.12, ..planted }])).is_err());
}
