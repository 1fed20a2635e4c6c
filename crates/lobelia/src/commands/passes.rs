use crate::failure::Failure;
use lobelia::graph::{Arity, PassInfo, PortInfo};
use std::io::Write;

/// List passes, or describe one: ports, parameters, units, ranges, defaults.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = "Examples:\n  lobelia passes\n  lobelia passes vpl-gather\n  lobelia passes --json")]
pub struct Arguments {
    /// Pass to describe; `_` and `-` are the same.
    name: Option<String>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let registry = lobelia::registry();
    let mut out = std::io::stdout().lock();
    let infos: Vec<&PassInfo> = match &arguments.name {
        None => registry.infos().collect(),
        Some(name) => {
            let unknown = || {
                let near = registry.nearest(name).map(|near| format!("; did you mean `{near}`?")).unwrap_or_default();
                Failure::Input(format!("no pass is called `{name}`{near}"))
            };
            vec![registry.info(name).ok_or_else(unknown)?]
        }
    };
    if arguments.json {
        let list: Vec<_> = infos.iter().map(|info| json(info)).collect();
        writeln!(out, "{:#}", serde_json::Value::from(list))?;
    } else if arguments.name.is_some() {
        for info in infos {
            describe(&mut out, info)?;
        }
    } else {
        for info in infos {
            let summary = info.doc.split(['\n']).next().unwrap_or_default();
            writeln!(out, "{:<16} {}", info.name, summary)?;
            let ports = |ports: &[PortInfo]| ports.iter().map(|port| port.resource.name).collect::<Vec<_>>().join(", ");
            writeln!(out, "{:<16}   {} -> {}", "", ports(&info.inputs), ports(&info.outputs))?;
        }
    }
    Ok(())
}

fn arity(port: &PortInfo) -> &'static str {
    match (port.arity, port.history) {
        (_, true) => "last frame's",
        (Arity::One, _) => "required",
        (Arity::Optional, _) => "optional",
        (Arity::List, _) => "any number",
    }
}

fn describe(out: &mut impl Write, info: &PassInfo) -> std::io::Result<()> {
    writeln!(out, "{} (in a graph file: {})\n\n{}\n", info.name, info.name.replace('-', "_"), info.doc)?;
    writeln!(out, "inputs")?;
    if info.inputs.is_empty() {
        writeln!(out, "  none; it reads the scene")?;
    }
    for port in &info.inputs {
        writeln!(out, "  {}: {} ({})\n      {}", port.name, port.resource.name, arity(port), port.doc)?;
    }
    writeln!(out, "outputs")?;
    for port in &info.outputs {
        writeln!(out, "  {}: {}\n      {} {}", port.name, port.resource.name, port.doc, port.resource.doc)?;
    }
    writeln!(out, "parameters")?;
    if info.params.is_empty() {
        writeln!(out, "  none")?;
    }
    for param in &info.params {
        let unit = if param.unit.is_empty() { String::new() } else { format!(", {}", param.unit) };
        let range = if param.range.is_empty() { String::new() } else { format!(", {}", param.range) };
        writeln!(out, "  {}: {}{unit}{range}, default {}\n      {}", param.name, param.kind, param.default, param.doc)?;
    }
    Ok(())
}

fn json(info: &PassInfo) -> serde_json::Value {
    let ports = |ports: &[PortInfo]| -> Vec<_> {
        let port =
            |port: &PortInfo| serde_json::json!({"name": port.name, "type": port.resource.name, "doc": port.doc, "arity": arity(port)});
        ports.iter().map(port).collect()
    };
    let params: Vec<_> = info
        .params
        .iter()
        .map(|param| {
            serde_json::json!({
                "name": param.name, "kind": param.kind, "unit": param.unit, "range": param.range, "default": param.default, "doc": param.doc,
            })
        })
        .collect();
    serde_json::json!({"name": info.name, "doc": info.doc, "inputs": ports(&info.inputs), "outputs": ports(&info.outputs), "params": params})
}
