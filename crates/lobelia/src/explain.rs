//! Says what a plan keeps, drops and saves: as text for people, as Graphviz for pictures.

use lobelia_frame::SceneWorld;
use lobelia_graph::Plan;

use crate::light::{Claim, uncast};
use std::fmt::Write;

/// Bytes in MiB with two decimals.
pub fn mebibytes(bytes: u64) -> String {
    format!("{:.2}", bytes as f64 / (1u64 << 20) as f64)
}

/// The plan in words. `general` is the same graph planned without specialising to the scene.
pub fn text(plan: &Plan<SceneWorld>, general: Option<&Plan<SceneWorld>>) -> String {
    let mut out = String::new();
    // Writing to a String cannot fail.
    let _ = write_text(&mut out, plan, general);
    out
}

fn write_text(out: &mut String, plan: &Plan<SceneWorld>, general: Option<&Plan<SceneWorld>>) -> std::fmt::Result {
    writeln!(out, "order ({} passes, {} x {} pixels)", plan.passes.len(), plan.extent[0], plan.extent[1])?;
    for (position, pass) in plan.passes.iter().enumerate() {
        writeln!(out, "  {:>2}. {} ({})  {}", position + 1, pass.name, pass.kind_name(), pass.params_ron())?;
        for (port, resources) in pass.input_ports().iter().zip(&pass.inputs) {
            let names = resources.iter().map(|index| plan.resources[*index].name.as_str()).collect::<Vec<_>>().join(", ");
            let names = if names.is_empty() { "nothing".into() } else { names };
            let history = if port.history { " of the frame before" } else { "" };
            writeln!(out, "        {} <- {names}{history}", port.name)?;
        }
        for specialisation in &pass.specialisations {
            let state = if specialisation.on { "on " } else { "off" };
            writeln!(out, "        {state} {}: {}", specialisation.flag, specialisation.reason)?;
        }
        for warning in &pass.warnings {
            writeln!(out, "        warning: {warning}")?;
        }
    }
    writeln!(out, "\ndropped")?;
    if plan.dropped.is_empty() {
        writeln!(out, "  nothing")?;
    }
    for dropped in &plan.dropped {
        let how = if dropped.forwards { "hands its input on" } else { "left out" };
        writeln!(out, "  {} ({}) is {how}: {}", dropped.pass, dropped.kind, dropped.reason)?;
    }
    let claim = Claim::of_all(plan);
    writeln!(out, "\nlight\n  cast: {}", claim.light)?;
    for pass in &claim.silent {
        writeln!(out, "  not stated: {pass} makes radiance, of which lights it does not say")?;
    }
    for sentence in uncast(&claim, plan.traits()) {
        writeln!(out, "  {sentence}")?;
    }
    writeln!(out, "\nmemory (MiB)")?;
    for resource in &plan.resources {
        let notes = [(resource.history, "two for history"), (resource.kept, "kept")];
        let notes = notes.iter().filter(|(on, _)| *on).map(|(_, note)| *note).collect::<Vec<_>>().join(", ");
        writeln!(out, "  {:>9}  {}: {} {notes}", mebibytes(resource.bytes()), resource.name, resource.type_name)?;
        for (part, slot) in resource.parts.iter().zip(&resource.slots) {
            let shared = plan.slots[*slot].users.len() > 1;
            let shared = if shared { format!("  shares slot {slot}") } else { String::new() };
            writeln!(out, "             {:>9}  {}{shared}", mebibytes(part.bytes()), part.name)?;
        }
    }
    writeln!(out, "  {:>9}  in all; {} if nothing were shared", mebibytes(plan.bytes()), mebibytes(plan.bytes_without_reuse()))?;
    if let Some(general) = general {
        let (with, without) = (plan.bytes(), general.bytes());
        let saved = if without > 0 { 100.0 * (1.0 - with as f64 / without as f64) } else { 0.0 };
        writeln!(out, "  {:>9}  without specialising to this scene: {saved:.1} % saved", mebibytes(without))?;
    }
    Ok(())
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// The plan as a Graphviz digraph: kept passes solid, dropped ones dashed, edges named by resource with their MiB, histories dotted.
pub fn dot(plan: &Plan<SceneWorld>) -> String {
    let mut out = String::from(
        "digraph lobelia {\n  rankdir=LR;\n  node [shape=box, style=rounded, fontname=\"Helvetica\"];\n  edge [fontname=\"Helvetica\", fontsize=10];\n",
    );
    let _ = write_dot(&mut out, plan);
    out.push_str("}\n");
    out
}

fn write_dot(out: &mut String, plan: &Plan<SceneWorld>) -> std::fmt::Result {
    for pass in &plan.passes {
        let label = format!("{}\\n{}", pass.name.replace('"', "'"), pass.kind_name());
        writeln!(out, "  {} [label=\"{label}\"];", quoted(&pass.name))?;
        for (port, resources) in pass.input_ports().iter().zip(&pass.inputs) {
            for index in resources {
                let resource = &plan.resources[*index];
                let style = if port.history { ", style=dotted, constraint=false" } else { "" };
                let label = format!("{}\\n{} MiB", resource.type_name, mebibytes(resource.bytes()));
                writeln!(out, "  {} -> {} [label=\"{label}\"{style}];", quoted(&plan.passes[resource.maker].name), quoted(&pass.name))?;
            }
        }
    }
    for dropped in &plan.dropped {
        writeln!(
            out,
            "  {} [label={}, style=\"rounded,dashed\", color=gray, fontcolor=gray, tooltip={}];",
            quoted(&dropped.pass),
            quoted(&dropped.pass),
            quoted(&dropped.reason)
        )?;
    }
    let output = &plan.resources[plan.output];
    writeln!(out, "  output [shape=plaintext, label={}];", quoted(&output.name))?;
    writeln!(out, "  {} -> output;", quoted(&plan.passes[output.maker].name))
}
