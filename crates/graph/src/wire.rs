//! The first half of planning, which needs neither scene nor device: variants and overrides are applied, passes and parameters are looked up and checked,
//! and every input port finds its producer.

use crate::{
    file::{GraphFile, PassEntry, Replacement, Spanned, ron_options, syntax_problem},
    pass::World,
    ports::{Arity, PortInfo},
    problem::{Problem, Problems},
    registry::{AnyParams, Kind, Registry},
};
use lobelia_base::nearest;
use petgraph::{algo::tarjan_scc, graph::DiGraph};
use std::{ops::Range, sync::Arc};

/// `pass.param=value` from the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    /// Name of the pass in the graph.
    pub pass: String,
    /// Parameter.
    pub param: String,
    /// Value as RON.
    pub value: String,
}

impl std::str::FromStr for Override {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parsed = text.split_once('=').and_then(|(path, value)| {
            let (pass, param) = path.trim().split_once('.')?;
            let value = value.trim();
            (!pass.is_empty() && !param.is_empty() && !value.is_empty()).then(|| (pass.to_owned(), param.to_owned(), value.to_owned()))
        });
        let (pass, param, value) =
            parsed.ok_or_else(|| format!("`{text}` is not of the form PASS.PARAM=VALUE, such as lights.count=1024"))?;
        Ok(Self { pass, param, value })
    }
}

/// An output port of a pass of this graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct PortRef {
    /// Index of the pass.
    pub pass: usize,
    /// Index of the output port.
    pub port: usize,
}

/// A pass with checked parameters and found producers.
pub(crate) struct WiredPass<W: World> {
    pub name: String,
    pub span: Range<usize>,
    pub kind: Arc<dyn Kind<W>>,
    pub params: Box<dyn AnyParams>,
    /// For each input port, its producers.
    pub sources: Vec<Vec<PortRef>>,
    /// For each input port, where its wiring is written, or the pass itself.
    pub port_spans: Vec<Range<usize>>,
}

impl<W: World> Clone for WiredPass<W> {
    fn clone(&self) -> Self {
        Self {
            name: self.name.clone(),
            span: self.span.clone(),
            kind: self.kind.clone(),
            params: self.params.boxed_clone(),
            sources: self.sources.clone(),
            port_spans: self.port_spans.clone(),
        }
    }
}

/// A graph whose names, parameters, types and wires are all right.
pub struct Wired<W: World> {
    pub(crate) file: GraphFile,
    pub(crate) passes: Vec<WiredPass<W>>,
    pub(crate) output: PortRef,
    /// Variants applied, in order.
    pub variants: Vec<String>,
}

impl GraphFile {
    /// Applies variants and overrides and checks everything that can be checked without a scene. All problems are reported at once.
    pub fn wire<W: World>(&self, registry: &Registry<W>, variants: &[String], overrides: &[Override]) -> Result<Wired<W>, Problems> {
        let mut problems = self.faults.clone();
        problems.extend(self.check_variant_names());
        let mut entries = self.passes.clone();
        for wanted in variants {
            match self.variants.iter().find(|(name, _)| name.text == *wanted) {
                Some((_, replacements)) => apply_variant(&mut entries, replacements),
                None => {
                    let near = nearest(wanted, self.variant_names()).map(|near| format!("did you mean `{near}`?"));
                    let all = self.variant_names().collect::<Vec<_>>().join(", ");
                    let help =
                        near.unwrap_or_else(|| if all.is_empty() { "the graph has no variants".into() } else { format!("it has {all}") });
                    problems.push(Problem::on_command_line(format!("{}: no variant is called `{wanted}`", self.path)).help(help));
                }
            }
        }
        let removed = take_removed(&mut entries);
        let mut output = self.output.clone();
        forward_removed(registry, &mut entries, &removed, &mut output);
        let overridden = check_override_names(&self.path, &entries, overrides, &mut problems);
        // Wiring goes on without the passes that nobody knows, so that every other mistake is told too; what only follows from theirs is not.
        let (known, unknown): (Vec<PassEntry>, Vec<PassEntry>) =
            entries.into_iter().partition(|entry| registry.find(&entry.kind.text).is_some());
        for entry in &unknown {
            problems.push(unknown_kind(registry, entry));
        }
        let mut passes: Vec<WiredPass<W>> = Vec::new();
        let mut entries = Vec::new();
        let mut unknown: Vec<&str> = unknown.iter().map(|entry| &entry.name.text).chain(&self.unread).map(String::as_str).collect();
        for entry in &known {
            match resolve_pass(self, registry, entry, &overridden, &mut problems) {
                Some(pass) => {
                    passes.push(pass);
                    entries.push(entry);
                }
                None => unknown.push(&entry.name.text),
            }
        }
        let names = Names { unknown, removed: removed.iter().map(|entry| entry.name.text.as_str()).collect() };
        Wiring { registry, entries: &entries, passes: &mut passes, problems: &mut problems, names: &names, meant: Vec::new() }.run();
        find_cycles(&passes, &mut problems);
        let output = find_output(&passes, &names, &output, &mut problems);
        match output {
            Some(output) if problems.is_empty() => Ok(Wired { file: self.clone(), passes, output, variants: variants.to_vec() }),
            _ => Err(self.fail(problems)),
        }
    }

    /// Checks the base and every variant, and gives the number of variants. `plan` looks at each that is well wired, to plan it for a scene, say. All mistakes of
    /// the file come at once, each once: one of the base that a variant leaves in place is not told again for the variant.
    pub fn check<W: World>(
        &self,
        registry: &Registry<W>,
        plan: &mut dyn FnMut(&Wired<W>) -> Result<(), Problems>,
    ) -> Result<usize, Problems> {
        let mut found: Vec<Problem> = Vec::new();
        let mut seen: Vec<(Option<Range<usize>>, String)> = Vec::new();
        for variant in std::iter::once(None).chain(self.variant_names().map(Some)) {
            let variants: Vec<String> = variant.iter().map(|name| (*name).to_owned()).collect();
            let Err(problems) = self.wire(registry, &variants, &[]).and_then(|wired| plan(&wired)) else { continue };
            for mut problem in problems.problems {
                // What follows names candidates, which differ from variant to variant.
                let subject = problem.message.split_once(": ").map_or(problem.message.as_str(), |(subject, _)| subject).to_owned();
                let key = (problem.span.clone(), subject);
                if seen.contains(&key) {
                    continue;
                }
                // A place in the base may be right without the variant, so the variant is named.
                if let Some(variant) = variant {
                    problem.message = format!("variant `{variant}`: {}", problem.message);
                }
                seen.push(key);
                found.push(problem);
            }
        }
        if found.is_empty() { Ok(self.variants.len()) } else { Err(self.fail(found)) }
    }

    /// Why an override fits no pass of the graph with these variants: it has no such pass, or the pass no such parameter. `None` if it fits, or if that cannot be
    /// told because the graph has another fault.
    pub fn lacks<W: World>(&self, registry: &Registry<W>, variants: &[String], item: &Override) -> Option<String> {
        let mut entries = self.passes.clone();
        for (_, replacements) in self.variants.iter().filter(|(name, _)| variants.contains(&name.text)) {
            apply_variant(&mut entries, replacements);
        }
        take_removed(&mut entries);
        let Some(entry) = entries.iter().find(|entry| entry.name.text == item.pass) else {
            return Some(format!("has no pass `{}`", item.pass));
        };
        let info = registry.info(&entry.kind.text)?;
        let known = info.params.iter().any(|param| param.name == item.param.replace('-', "_"));
        (!known).then(|| format!("has a pass `{}` of kind {}, without a parameter `{}`", item.pass, info.name, item.param))
    }

    /// Passes that a variant names must be in the graph, whichever variant is asked for.
    fn check_variant_names(&self) -> Vec<Problem> {
        let mut problems = Vec::new();
        for (variant, replacements) in &self.variants {
            for name in replacements.iter().map(Replacement::name) {
                if !self.passes.iter().any(|pass| pass.name.text == name.text) && !self.unread.contains(&name.text) {
                    let near = nearest(&name.text, self.passes.iter().map(|pass| pass.name.text.as_str()));
                    problems.push(
                        Problem::at(
                            name.span.clone(),
                            format!("variant `{}` names no pass: the graph has no `{}` to replace", variant.text, name.text),
                        )
                        .maybe_help(near.map(|near| format!("did you mean `{near}`?"))),
                    );
                }
            }
        }
        problems
    }
}

/// Names of passes that are not there to be wired.
struct Names<'a> {
    /// Their own mistakes are told; what follows from them is not.
    unknown: Vec<&'a str>,
    /// Taken out by a variant, where nothing could be handed on in their place.
    removed: Vec<&'a str>,
}

/// What a variant makes of the entries. A pass that is taken out stays, marked as such, until [`take_removed`]: a later variant may put it back.
fn apply_variant(entries: &mut [PassEntry], replacements: &[Replacement]) {
    for replacement in replacements {
        let Some(entry) = entries.iter_mut().find(|entry| entry.name.text == replacement.name().text) else { continue };
        match replacement {
            Replacement::Pass(other) => *entry = other.clone(),
            Replacement::Remove(_) => entry.removed = true,
        }
    }
}

/// Takes out the passes that variants removed, and gives them back.
fn take_removed(entries: &mut Vec<PassEntry>) -> Vec<PassEntry> {
    let (removed, kept) = std::mem::take(entries).into_iter().partition(|entry| entry.removed);
    *entries = kept;
    removed
}

/// Whoever names an output of a removed pass gets what that pass would have read, if it has just one input of that type and that is fed by one pass: a filter that
/// is taken out of a chain hands its input on. Where there is no such input the name stays as it is and is told to be gone.
fn forward_removed<W: World>(registry: &Registry<W>, entries: &mut [PassEntry], removed: &[PassEntry], output: &mut Spanned) {
    let others = entries.to_vec();
    let texts = entries.iter_mut().flat_map(|entry| entry.from.iter_mut().flat_map(|(_, sources)| sources.iter_mut()));
    for text in texts.chain(std::iter::once(output)) {
        // A chain of removed passes is followed to its beginning; one that leads back to itself has none.
        for _ in 0..removed.len() {
            match handed_on(registry, &others, removed, &text.text) {
                Some(source) => text.text = source,
                None => break,
            }
        }
    }
}

/// `pass.port` of what the removed pass in `text` would have read where its output is read.
fn handed_on<W: World>(registry: &Registry<W>, others: &[PassEntry], removed: &[PassEntry], text: &str) -> Option<String> {
    let (name, port) = text.split_once('.').map_or((text, None), |(pass, port)| (pass, Some(port)));
    let entry = removed.iter().find(|entry| entry.name.text == name)?;
    let info = registry.info(&entry.kind.text)?;
    let made = match port {
        Some(port) => info.outputs.iter().find(|output| output.name == port)?,
        None => info.outputs.first().filter(|_| info.outputs.len() == 1)?,
    };
    let mut inputs = info.inputs.iter().filter(|input| input.resource == made.resource && !input.history);
    let (input, None) = (inputs.next()?, inputs.next()) else { return None };
    if let Some((_, sources)) = entry.from.iter().find(|(port, _)| port.text == input.name) {
        return sources.first().filter(|_| sources.len() == 1).map(|source| source.text.clone());
    }
    // It would have been wired by type; the pass that reads it does not count, since it comes after.
    let reads_it =
        |other: &PassEntry| other.from.iter().flat_map(|(_, sources)| sources).any(|source| source.text.split('.').next() == Some(name));
    let mut producers = others.iter().filter(|other| !reads_it(other)).flat_map(|other| {
        let outputs = registry.info(&other.kind.text).map(|info| info.outputs.as_slice()).unwrap_or_default();
        outputs.iter().filter(|output| output.resource == made.resource).map(|output| format!("{}.{}", other.name.text, output.name))
    });
    let (producer, None) = (producers.next()?, producers.next()) else { return None };
    Some(producer)
}

fn unknown_kind<W: World>(registry: &Registry<W>, entry: &PassEntry) -> Problem {
    let near = registry.nearest(&entry.kind.text).map(|near| format!("did you mean `{}`?", near.replace('-', "_")));
    let help = near.unwrap_or_else(|| "`lobelia passes` lists them all".into());
    let what = format!("pass `{}`: no kind of pass is called `{}`", entry.name.text, entry.kind.text);
    Problem::at(entry.kind.span.clone(), what).help(help)
}

/// Keeps the overrides that name a pass of the graph.
fn check_override_names<'a>(
    path: &str,
    entries: &[PassEntry],
    overrides: &'a [Override],
    problems: &mut Vec<Problem>,
) -> Vec<&'a Override> {
    overrides
        .iter()
        .filter(|item| {
            let known = entries.iter().any(|entry| entry.name.text == item.pass);
            if !known {
                let near = nearest(&item.pass, entries.iter().map(|entry| entry.name.text.as_str()));
                problems.push(
                    Problem::on_command_line(format!("--set {}.{}: {path} has no pass `{}`", item.pass, item.param, item.pass))
                        .maybe_help(near.map(|near| format!("did you mean `{near}`?"))),
                );
            }
            known
        })
        .collect()
}

fn resolve_pass<W: World>(
    file: &GraphFile,
    registry: &Registry<W>,
    entry: &PassEntry,
    overrides: &[&Override],
    problems: &mut Vec<Problem>,
) -> Option<WiredPass<W>> {
    let kind = registry.find(&entry.kind.text)?;
    let params = resolve_params(file, kind.as_ref(), entry, overrides, problems)?;
    let inputs = kind.info().inputs.len();
    Some(WiredPass {
        name: entry.name.text.clone(),
        span: entry.name.span.clone(),
        kind: kind.clone(),
        params,
        sources: vec![Vec::new(); inputs],
        port_spans: vec![entry.name.span.clone(); inputs],
    })
}

/// Reads parameters one at a time, so that each fault has its own place, then those that are right together: a pass with a wrong one can still be wired, and its
/// other parameters can still be out of range. `None` where not even that could be read.
fn resolve_params<W: World>(
    file: &GraphFile,
    kind: &dyn Kind<W>,
    entry: &PassEntry,
    overrides: &[&Override],
    problems: &mut Vec<Problem>,
) -> Option<Box<dyn AnyParams>> {
    let pass = &entry.name.text;
    let known: Vec<&str> = kind.info().params.iter().map(|param| param.name).collect();
    let unknown_help = |name: &str| match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None if known.is_empty() => format!("`{}` has no parameters", kind.info().name),
        None => format!("`{}` has {}", kind.info().name, known.join(", ")),
    };
    let before = problems.len();
    // Name, value, and the place in the file; the command line has none.
    let mut values: Vec<(String, String, Option<Range<usize>>)> = Vec::new();
    for (name, value) in &entry.params {
        if !known.contains(&name.text.as_str()) {
            let what = format!("pass `{pass}` ({}) has no parameter `{}`", kind.info().name, name.text);
            problems.push(Problem::at(name.span.clone(), what).help(unknown_help(&name.text)));
            continue;
        }
        if let Err(error) = kind.parse(&format!("({}:{})", name.text, value.text)) {
            problems.push(value_problem(file, kind, pass, name, value, &error));
            continue;
        }
        values.push((name.text.clone(), value.text.clone(), Some(value.span.clone())));
    }
    for item in overrides.iter().filter(|item| item.pass == *pass) {
        let name = item.param.replace('-', "_");
        if !known.contains(&name.as_str()) {
            let what = format!("--set {pass}.{}: pass `{pass}` ({}) has no parameter `{}`", item.param, kind.info().name, item.param);
            problems.push(Problem::on_command_line(what).help(unknown_help(&name)));
            continue;
        }
        // The value must be one value: `64, seed: 5` would set two parameters.
        let one = ron_options().from_str::<&ron::value::RawValue>(&item.value).map(|_| ());
        if let Err(error) = one.and_then(|()| kind.parse(&format!("({name}:{})", item.value)).map(|_| ())) {
            let fault = unfit(kind, &name, &error.code).unwrap_or_else(|| error.code.to_string());
            let what = format!("--set {pass}.{name}: `{}` is not a value for it: {fault}", item.value);
            problems.push(Problem::on_command_line(what).maybe_help(param_help(kind, &name)));
            continue;
        }
        values.retain(|(existing, ..)| *existing != name);
        values.push((name, item.value.clone(), None));
    }
    let all = values.iter().map(|(name, value, _)| format!("{name}:{value}")).collect::<Vec<_>>().join(",");
    let params = match kind.parse(&format!("({all})")) {
        Ok(params) => params,
        Err(error) => {
            if problems.len() == before {
                problems.push(Problem::at(entry.name.span.clone(), format!("pass `{pass}`: {}", error.code)));
            }
            return None;
        }
    };
    for problem in kind.problems(params.as_ref()) {
        let place = values.iter().find(|(name, ..)| name == problem.name);
        let help = param_help(kind, problem.name);
        problems.push(match place.and_then(|(.., span)| span.clone()) {
            Some(span) => Problem::at(span, format!("pass `{pass}`: {}", problem.message)).maybe_help(help),
            None => Problem::on_command_line(format!("--set {pass}.{}: {}", problem.name, problem.message)).maybe_help(help),
        });
    }
    Some(params)
}

fn value_problem<W: World>(
    file: &GraphFile,
    kind: &dyn Kind<W>,
    pass: &str,
    name: &Spanned,
    value: &Spanned,
    error: &ron::error::SpannedError,
) -> Problem {
    let slice = file.text.get(value.span.clone()).unwrap_or_default();
    // The value was read behind `(name:`; move the place back to the value.
    let shift = name.text.chars().count() + 2;
    let mut moved = error.clone();
    for place in [&mut moved.span.start, &mut moved.span.end] {
        if place.line == 1 {
            place.col = place.col.saturating_sub(shift).max(1);
        }
    }
    let mut problem = syntax_problem(slice, value.span.start, &moved);
    if let Some(span) = &mut problem.span {
        // Trailing text of the wrapper, or the middle of a number, may be named; the value itself is what the reader should look at.
        let scalar = !value.text.contains(['(', '[', '{', '"']);
        if scalar || span.start >= value.span.end {
            *span = value.span.clone();
        }
    }
    let fault = unfit(kind, &name.text, &error.code).unwrap_or(problem.message);
    problem.message = format!("pass `{pass}`: `{}` cannot be {}: {fault}", name.text, value.text);
    problem.maybe_help(param_help(kind, &name.text))
}

/// A number that its reader leaves half-read, such as 1.5 for an integer, is said to lack a comma; what it lacks is the type.
fn unfit<W: World>(kind: &dyn Kind<W>, name: &str, error: &ron::Error) -> Option<String> {
    let param = kind.info().params.iter().find(|param| param.name == name)?;
    matches!(error, ron::Error::ExpectedComma).then(|| format!("Expected {}", param.kind))
}

fn param_help<W: World>(kind: &dyn Kind<W>, name: &str) -> Option<String> {
    let param = kind.info().params.iter().find(|param| param.name == name)?;
    let unit = if param.unit.is_empty() { String::new() } else { format!(", in {}", param.unit) };
    let range = if param.range.is_empty() { String::new() } else { format!(", in the range {}", param.range) };
    Some(format!("`{name}` is {}{unit}{range}; its default is {}", param.kind, param.default))
}

fn find_output<W: World>(passes: &[WiredPass<W>], names: &Names<'_>, output: &Spanned, problems: &mut Vec<Problem>) -> Option<PortRef> {
    match find_port(passes, &output.text) {
        Ok(found) => Some(found),
        Err(_) if names.is_unknown(&output.text) => None,
        Err(help) => {
            let help = names.removed_help(&output.text).unwrap_or(help);
            problems.push(Problem::at(output.span.clone(), format!("output: there is no `{}` in this graph", output.text)).help(help));
            None
        }
    }
}

impl Names<'_> {
    fn is_unknown(&self, text: &str) -> bool {
        self.unknown.contains(&text.split('.').next().unwrap_or_default())
    }

    /// Why a pass that was taken out left nothing in its place.
    fn removed_help(&self, text: &str) -> Option<String> {
        let name = text.split('.').next().unwrap_or_default();
        self.removed.contains(&name).then(|| {
            format!(
                "the variant takes `{name}` out, which has no single input of that type to hand on; name another producer in the variant"
            )
        })
    }
}

/// Finds `pass.port`, or `pass` if it has one output; the error says what is near.
fn find_port<W: World>(passes: &[WiredPass<W>], text: &str) -> Result<PortRef, String> {
    let (pass_name, port_name) = text.split_once('.').map_or((text, None), |(pass, port)| (pass, Some(port)));
    let Some(pass) = passes.iter().position(|pass| pass.name == pass_name) else {
        let all = passes.iter().map(|pass| pass.name.as_str());
        return Err(match nearest(pass_name, all.clone()) {
            Some(near) => format!("did you mean `{near}`?"),
            None if passes.is_empty() => "the graph has no passes".into(),
            None => format!("the passes are {}", all.collect::<Vec<_>>().join(", ")),
        });
    };
    let outputs = &passes[pass].kind.info().outputs;
    let listed = || outputs.iter().map(|port| format!("`{pass_name}.{}`", port.name)).collect::<Vec<_>>().join(", ");
    match port_name {
        None if outputs.len() == 1 => Ok(PortRef { pass, port: 0 }),
        None => Err(format!("say which output: {}", listed())),
        Some(name) => match outputs.iter().position(|port| port.name == name) {
            Some(port) => Ok(PortRef { pass, port }),
            None => Err(match nearest(name, outputs.iter().map(|port| port.name)) {
                Some(near) => format!("did you mean `{pass_name}.{near}`?"),
                None => format!("`{pass_name}` makes {}", listed()),
            }),
        },
    }
}

impl<W: World> Wired<W> {
    /// Finds `pass.port`, for `--save` and readers of results.
    pub fn find_port(&self, text: &str) -> Result<PortRef, Problems> {
        find_port(&self.passes, text).map_err(|help| {
            self.file.fail(vec![Problem::on_command_line(format!("there is no `{text}` in {}", self.file.path)).help(help)])
        })
    }

    /// Names of all passes, in the order of the file.
    pub fn pass_names(&self) -> impl Iterator<Item = &str> {
        self.passes.iter().map(|pass| pass.name.as_str())
    }
}

struct Wiring<'a, W: World> {
    registry: &'a Registry<W>,
    /// Those of `passes`, in the same order.
    entries: &'a [&'a PassEntry],
    passes: &'a mut Vec<WiredPass<W>>,
    problems: &'a mut Vec<Problem>,
    names: &'a Names<'a>,
    /// Readers and producers of wires that are written but wrong. They count as dependencies, so that a mistake does not make other wires ambiguous.
    meant: Vec<(usize, usize)>,
}

impl<W: World> Wiring<'_, W> {
    fn run(&mut self) {
        let mut explicit: Vec<Vec<bool>> = self.passes.iter().map(|pass| vec![false; pass.sources.len()]).collect();
        for (index, flags) in explicit.iter_mut().enumerate() {
            self.wire_explicit(index, flags);
        }
        // Single ports first: a list takes every producer that does not depend on its pass, which is only known when the rest is wired.
        for lists in [false, true] {
            for (index, flags) in explicit.iter().enumerate() {
                let ports = self.passes[index].kind.info().inputs.clone();
                for (port_index, port) in ports.iter().enumerate() {
                    if !flags[port_index] && (port.arity == Arity::List) == lists {
                        self.wire_by_type(index, port_index, port);
                    }
                }
            }
        }
    }

    fn wire_explicit(&mut self, index: usize, explicit: &mut [bool]) {
        let kind = self.passes[index].kind.clone();
        let inputs = &kind.info().inputs;
        let pass_name = self.passes[index].name.clone();
        for (port_name, sources) in &self.entries[index].from.clone() {
            let Some(port_index) = inputs.iter().position(|port| port.name == port_name.text) else {
                let listed = inputs.iter().map(|port| port.name).collect::<Vec<_>>().join(", ");
                let help = match nearest(&port_name.text, inputs.iter().map(|port| port.name)) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None if inputs.is_empty() => format!("`{}` has no inputs", kind.info().name),
                    None => format!("its inputs are {listed}"),
                };
                let what = format!("pass `{pass_name}` ({}) has no input port `{}`", kind.info().name, port_name.text);
                self.problems.push(Problem::at(port_name.span.clone(), what).help(help));
                continue;
            };
            let port = &inputs[port_index];
            explicit[port_index] = true;
            self.passes[index].port_spans[port_index] = port_name.span.clone();
            self.check_count(&pass_name, port, port_name, sources.len());
            for source in sources {
                if let Some(found) = self.check_source(index, &pass_name, port, source) {
                    self.passes[index].sources[port_index].push(found);
                }
            }
        }
    }

    fn check_count(&mut self, pass: &str, port: &PortInfo, place: &Spanned, count: usize) {
        let complaint = match port.arity {
            Arity::One if count == 0 => "is required and cannot be left empty",
            Arity::One | Arity::Optional if count > 1 => "takes one producer, not several",
            _ => return,
        };
        let what = format!("pass `{pass}`, port `{}: {}`: it {complaint}", port.name, port.resource.name);
        self.problems.push(Problem::at(place.span.clone(), what));
    }

    fn check_source(&mut self, index: usize, pass: &str, port: &PortInfo, source: &Spanned) -> Option<PortRef> {
        match find_port(self.passes, &source.text) {
            Err(_) if self.names.is_unknown(&source.text) => None,
            Err(help) => {
                let help = self.names.removed_help(&source.text).unwrap_or(help);
                let name = source.text.split('.').next().unwrap_or_default();
                let near = nearest(name, self.passes.iter().map(|pass| pass.name.as_str()));
                if let Some(meant) = self.passes.iter().position(|pass| Some(pass.name.as_str()) == near) {
                    self.meant.push((index, meant));
                }
                let what =
                    format!("pass `{pass}`, port `{}: {}`: there is no `{}` in this graph", port.name, port.resource.name, source.text);
                self.problems.push(Problem::at(source.span.clone(), what).help(help));
                None
            }
            Ok(found) => {
                let made = self.passes[found.pass].kind.info().outputs[found.port].resource;
                if made == port.resource {
                    return Some(found);
                }
                self.meant.push((index, found.pass));
                let fitting = self.producers(port);
                let help = match fitting.as_slice() {
                    [] => format!("no pass of this graph makes a {}", port.resource.name),
                    some => format!("{} made by {}", port.resource.name, self.list(some)),
                };
                let what =
                    format!("pass `{pass}`, port `{}`: expected {}, but `{}` is {}", port.name, port.resource.name, source.text, made.name);
                self.problems.push(Problem::at(source.span.clone(), what).help(help));
                None
            }
        }
    }

    fn producers(&self, port: &PortInfo) -> Vec<PortRef> {
        let outputs = self.passes.iter().enumerate().flat_map(|(pass, wired)| {
            let ports = wired.kind.info().outputs.iter().enumerate();
            ports.filter(|(_, output)| output.resource == port.resource).map(move |(port, _)| PortRef { pass, port }).collect::<Vec<_>>()
        });
        outputs.collect()
    }

    fn list(&self, ports: &[PortRef]) -> String {
        let names = ports.iter().map(|found| {
            let pass = &self.passes[found.pass];
            format!("`{}.{}`", pass.name, pass.kind.info().outputs[found.port].name)
        });
        names.collect::<Vec<_>>().join(", ")
    }

    /// Whether `pass` reads, directly or not, what `other` makes.
    fn depends_on(&self, pass: usize, other: usize) -> bool {
        let mut seen = vec![false; self.passes.len()];
        let mut open = vec![pass];
        while let Some(current) = open.pop() {
            if current == other {
                return true;
            }
            if std::mem::replace(&mut seen[current], true) {
                continue;
            }
            open.extend(self.meant.iter().filter(|(reader, _)| *reader == current).map(|(_, producer)| *producer));
            let wired = &self.passes[current];
            for (port, sources) in wired.kind.info().inputs.iter().zip(&wired.sources) {
                if !port.history {
                    open.extend(sources.iter().map(|source| source.pass));
                }
            }
        }
        false
    }

    fn wire_by_type(&mut self, index: usize, port_index: usize, port: &PortInfo) {
        let mut candidates = self.producers(port);
        if !port.history {
            candidates.retain(|found| found.pass != index && !self.depends_on(found.pass, index));
        }
        let pass = &self.passes[index];
        let what = format!("pass `{}` ({}), port `{}: {}`", pass.name, pass.kind.info().name, port.name, port.resource.name);
        let span = pass.span.clone();
        match (port.arity, candidates.len()) {
            (Arity::List, _) | (_, 1) => self.passes[index].sources[port_index] = candidates,
            (Arity::Optional, 0) => {}
            // It may be what an unknown pass would have made.
            (Arity::One, 0) if !self.names.unknown.is_empty() => {}
            (Arity::One, 0) => {
                let kinds: Vec<_> =
                    self.registry.infos().filter(|info| info.outputs.iter().any(|output| output.resource == port.resource)).collect();
                let help = match kinds.as_slice() {
                    [] => format!("no registered pass makes a {}", port.resource.name),
                    some => format!(
                        "add a pass that makes a {}: {}",
                        port.resource.name,
                        some.iter().map(|info| info.name.replace('-', "_")).collect::<Vec<_>>().join(", ")
                    ),
                };
                self.problems.push(
                    Problem::at(span, format!("{what} is not connected: nothing in this graph makes a {}", port.resource.name)).help(help),
                );
            }
            (Arity::One | Arity::Optional, _) => {
                let first = &self.passes[candidates[0].pass];
                let example = format!("{}.{}", first.name, first.kind.info().outputs[candidates[0].port].name);
                let list = self.list(&candidates);
                let help = format!("say which: from: {{\"{}\": \"{example}\"}}", port.name);
                self.problems.push(Problem::at(span, format!("{what} is ambiguous: it could come from {list}")).help(help));
            }
        }
    }
}

fn find_cycles<W: World>(passes: &[WiredPass<W>], problems: &mut Vec<Problem>) {
    let graph = dependency_graph(passes);
    for component in tarjan_scc(&graph) {
        let mut members: Vec<usize> = component.iter().map(|node| node.index()).collect();
        members.sort_unstable();
        let is_cycle = members.len() > 1 || graph.contains_edge(component[0], component[0]);
        if is_cycle {
            let names = members.iter().map(|index| format!("`{}`", passes[*index].name)).collect::<Vec<_>>().join(", ");
            let what = if members.len() == 1 {
                format!("pass {names} reads its own output")
            } else {
                format!("passes {names} wait for each other in a cycle")
            };
            let help = "break it with a `from` that names another producer, or read last frame's value through a history port";
            problems.push(Problem::at(passes[members[0]].span.clone(), what).help(help));
        }
    }
}

/// Edges from producers to consumers; history makes none.
pub(crate) fn dependency_graph<W: World>(passes: &[WiredPass<W>]) -> DiGraph<usize, ()> {
    let mut graph = DiGraph::new();
    let nodes: Vec<_> = (0..passes.len()).map(|index| graph.add_node(index)).collect();
    for (index, pass) in passes.iter().enumerate() {
        for (port, sources) in pass.kind.info().inputs.iter().zip(&pass.sources) {
            if !port.history {
                for source in sources {
                    graph.update_edge(nodes[source.pass], nodes[index], ());
                }
            }
        }
    }
    graph
}
