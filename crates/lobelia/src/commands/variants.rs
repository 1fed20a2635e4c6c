use crate::failure::Failure;
use lobelia::{
    graph::GraphFile,
    variants::{Change, variants},
};
use std::{io::Write, path::PathBuf};

/// List the variants of a graph: the comment above each in the file, and what it replaces.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:\n  lobelia variants graphs/indirect.ron\n  lobelia variants graphs/indirect.ron --json")]
pub struct Arguments {
    /// Graph file (RON).
    #[arg(value_name = "GRAPH")]
    graph: PathBuf,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let list = variants(&GraphFile::load(&arguments.graph)?);
    let mut out = std::io::stdout().lock();
    if arguments.json {
        writeln!(out, "{:#}", serde_json::json!(list))?;
        return Ok(());
    }
    if list.is_empty() {
        writeln!(out, "{} has no variants", arguments.graph.display())?;
    }
    for variant in &list {
        writeln!(out, "{}", variant.name)?;
        for line in variant.doc.lines() {
            writeln!(out, "  {line}")?;
        }
        for change in &variant.changes {
            writeln!(out, "    {}", describe(change))?;
        }
    }
    Ok(())
}

fn describe(change: &Change) -> String {
    let kinds = match (&change.before, &change.after) {
        (Some(before), Some(after)) if before == after => before.clone(),
        (Some(before), Some(after)) => format!("{before} -> {after}"),
        (None, Some(after)) => format!("{after}, added"),
        (_, None) => "taken out".to_owned(),
    };
    let value = |value: &Option<String>| value.clone().unwrap_or_else(|| "default".into());
    let params = change.params.iter().map(|param| format!(", {}: {} -> {}", param.name, value(&param.before), value(&param.after)));
    // Where the kind is another one, what the base does not write is no default of this kind.
    let other = change.before != change.after;
    let params: String = if other {
        change.params.iter().map(|param| format!(", {}: {}", param.name, value(&param.after))).collect()
    } else {
        params.collect()
    };
    format!("{}: {kinds}{params}", change.pass)
}
