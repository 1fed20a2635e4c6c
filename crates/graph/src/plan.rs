//! The second half of planning: what this scene requires of a wired graph.
//!
//! Each pass is asked whether the scene needs it; what is not needed is dropped, and with it what only fed it or cannot do without it. What
//! remains is shaped, specialised, put in order, and its textures share memory where their lifetimes do not overlap. All of it is pure.

use crate::{
    pass::{Need, Specialisation, World},
    ports::{AnyShape, Arity, PortInfo, PortValue},
    problem::{Problem, Problems},
    registry::{AnyParams, ErasedPlanContext, Kind},
    resource::{Part, PartKind},
    wire::{PortRef, Wired, WiredPass, dependency_graph},
};
use lobelia_shaders::Flags;
use petgraph::visit::EdgeRef;
use std::{
    collections::BTreeMap,
    hash::{DefaultHasher, Hash, Hasher},
    sync::Arc,
};

/// What a plan is made for, apart from the graph.
#[derive(Clone, Debug)]
pub struct PlanOptions {
    /// Size of the picture in pixels, each side >= 1.
    pub extent: [u32; 2],
    /// `pass.port` texts of further resources to keep and to be able to read.
    pub keep: Vec<String>,
    /// `false`: shaders and resources are not specialised to the scene, which is the yardstick for what specialising saves.
    pub specialise: bool,
    /// Another output than the file names.
    pub output: Option<String>,
    /// `false`: textures never share memory.
    pub reuse: bool,
}

impl PlanOptions {
    /// Everything on, nothing kept beside the output.
    pub fn new(extent: [u32; 2]) -> Self {
        Self { extent, keep: Vec::new(), specialise: true, output: None, reuse: true }
    }
}

/// A pass that runs.
pub struct PlannedPass<W: World> {
    pub(crate) kind: Arc<dyn Kind<W>>,
    pub(crate) params: Box<dyn AnyParams>,
    pub(crate) flags: Flags,
    /// Name in the graph.
    pub name: String,
    /// Shader flags with their reasons.
    pub specialisations: Vec<Specialisation>,
    /// What it adds to a picture, if it states that.
    pub claim: Option<W::Claim>,
    /// What a user should know, see [`crate::Pass::warnings`].
    pub warnings: Vec<String>,
    /// For each input port, the producers that are left, as indices into [`Plan::resources`].
    pub inputs: Vec<Vec<usize>>,
    /// For each output port, its resource.
    pub outputs: Vec<usize>,
}

impl<W: World> PlannedPass<W> {
    /// Registered name.
    pub fn kind_name(&self) -> &'static str {
        self.kind.info().name
    }

    /// Output ports.
    pub fn output_ports(&self) -> &[PortInfo] {
        &self.kind.info().outputs
    }

    /// Input ports.
    pub fn input_ports(&self) -> &[PortInfo] {
        &self.kind.info().inputs
    }

    /// Parameters as RON.
    pub fn params_ron(&self) -> String {
        self.params.to_ron()
    }

    /// Parameters as JSON.
    pub fn params_json(&self) -> serde_json::Value {
        self.params.to_json()
    }
}

/// A value that one pass makes.
pub struct PlannedResource {
    /// `pass.port`.
    pub name: String,
    /// Name of its type.
    pub type_name: &'static str,
    /// Index of its maker in [`Plan::passes`].
    pub maker: usize,
    /// Position of the last reader; the end if it is kept.
    pub last_use: usize,
    /// Whether next frame reads it, which doubles it.
    pub history: bool,
    /// Whether the caller may read it after the frame.
    pub kept: bool,
    /// Textures and buffers.
    pub parts: Vec<Part>,
    /// For each part, its slot; with history, the second side's slots follow.
    pub slots: Vec<usize>,
    pub(crate) shape: Box<dyn AnyShape>,
}

impl PlannedResource {
    /// Memory in bytes, before sharing; history counts twice.
    pub fn bytes(&self) -> u64 {
        let once: u64 = self.parts.iter().map(Part::bytes).sum();
        if self.history { 2 * once } else { once }
    }

    pub(crate) fn value(&self) -> Box<dyn AnyShape> {
        self.shape.as_ref().boxed_clone()
    }
}

/// An allocation that one or more parts use one after the other.
#[derive(Clone, Debug)]
pub struct Slot {
    /// What is allocated.
    pub kind: PartKind,
    /// Bytes.
    pub bytes: u64,
    /// Users in order: resource index and part name.
    pub users: Vec<(usize, &'static str)>,
}

/// A pass that was left out, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Dropped {
    /// Name in the graph.
    pub pass: String,
    /// Registered name.
    pub kind: &'static str,
    /// The reason.
    pub reason: String,
    /// Whether its input is handed on in its place.
    pub forwards: bool,
}

/// What will run, in order, with which resources.
pub struct Plan<W: World> {
    /// Passes in the order they run.
    pub passes: Vec<PlannedPass<W>>,
    /// Everything that is made.
    pub resources: Vec<PlannedResource>,
    /// Allocations.
    pub slots: Vec<Slot>,
    /// What was left out.
    pub dropped: Vec<Dropped>,
    /// Index of the output.
    pub output: usize,
    /// Size of the picture.
    pub extent: [u32; 2],
    pub(crate) traits: W::Traits,
    pub(crate) aliases: BTreeMap<String, usize>,
}

impl<W: World> Plan<W> {
    /// Memory of all slots in bytes.
    pub fn bytes(&self) -> u64 {
        self.slots.iter().map(|slot| slot.bytes).sum()
    }

    /// Memory that the same resources would take if none were shared.
    pub fn bytes_without_reuse(&self) -> u64 {
        self.resources.iter().map(PlannedResource::bytes).sum()
    }

    /// What the passes have to say to the user, each with the name of its pass.
    pub fn warnings(&self) -> impl Iterator<Item = String> + '_ {
        self.passes.iter().flat_map(|pass| pass.warnings.iter().map(|warning| format!("pass `{}`: {warning}", pass.name)))
    }

    /// Index of a kept resource by `pass.port` (or `pass` where that is unique); a forwarding pass answers with what it forwards.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.aliases.get(name).copied()
    }

    /// Indices of the passes that a resource is made from, last frame's included, in the order in which they run.
    pub fn behind(&self, resource: usize) -> Vec<usize> {
        let mut found = vec![false; self.passes.len()];
        let mut open = vec![self.resources[resource].maker];
        while let Some(pass) = open.pop() {
            if !std::mem::replace(&mut found[pass], true) {
                open.extend(self.passes[pass].inputs.iter().flatten().map(|input| self.resources[*input].maker));
            }
        }
        (0..found.len()).filter(|pass| found[*pass]).collect()
    }

    /// What a resource holds by the word of the passes that it is made from: the union of their claims.
    pub fn claim(&self, resource: usize) -> W::Claim {
        let stated = self.behind(resource).into_iter().filter_map(|pass| self.passes[pass].claim.clone());
        stated.fold(W::Claim::default(), |mut sum, claim| {
            sum |= claim;
            sum
        })
    }

    /// The traits that the plan was made with.
    pub fn traits(&self) -> &W::Traits {
        &self.traits
    }

    /// A number that differs when passes, parameters, flags, wiring or shapes differ; histories do not outlive it.
    pub fn fingerprint(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        self.extent.hash(&mut hasher);
        for pass in &self.passes {
            pass.name.hash(&mut hasher);
            pass.kind_name().hash(&mut hasher);
            pass.params_ron().hash(&mut hasher);
            pass.flags.hash(&mut hasher);
            pass.inputs.hash(&mut hasher);
        }
        for resource in &self.resources {
            resource.name.hash(&mut hasher);
            resource.shape.as_ref().describe().hash(&mut hasher);
        }
        hasher.finish()
    }
}

/// What became of a pass.
enum Fate {
    Runs,
    Forwards(String),
    Gone(String),
}

impl<W: World> Wired<W> {
    /// Plans this graph for a scene.
    pub fn plan(&self, traits: &W::Traits, options: &PlanOptions) -> Result<Plan<W>, Problems> {
        let traits = if options.specialise { traits.clone() } else { W::unspecialised(traits) };
        let mut roots = vec![match &options.output {
            Some(text) => self.find_port(text)?,
            None => self.output,
        }];
        for text in &options.keep {
            roots.push(self.find_port(text)?);
        }
        let order = self.order();
        let pruning = self.prune(&traits, &roots, &order);
        let mut planner = Planner {
            wired: self,
            options,
            traits: &traits,
            pruning: &pruning,
            passes: Vec::new(),
            resources: Vec::new(),
            made: BTreeMap::new(),
        };
        planner.shape_all(&order).map_err(|problems| self.file.fail(problems))?;
        let mut kept = Vec::new();
        for root in &roots {
            kept.push(planner.kept_resource(*root).map_err(|problem| self.file.fail(vec![problem]))?);
        }
        let Planner { passes, mut resources, made, .. } = planner;
        mark_uses(&passes, &mut resources, &kept);
        let slots = allocate(&passes, &mut resources, options.reuse);
        let aliases = self.aliases(&pruning, &made);
        Ok(Plan { passes, resources, slots, dropped: pruning.dropped(self), output: kept[0], extent: options.extent, traits, aliases })
    }

    /// Producers before consumers; where there is a choice, the order of the file.
    fn order(&self) -> Vec<usize> {
        let graph = dependency_graph(&self.passes);
        let mut waiting: Vec<usize> =
            graph.node_indices().map(|node| graph.edges_directed(node, petgraph::Direction::Incoming).count()).collect();
        let mut done = vec![false; self.passes.len()];
        let mut order = Vec::new();
        // Cycles were refused when the graph was wired, so there is always a pass that waits for nothing.
        while let Some(next) = (0..self.passes.len()).find(|index| !done[*index] && waiting[*index] == 0) {
            done[next] = true;
            order.push(next);
            for edge in graph.edges(petgraph::graph::NodeIndex::new(next)) {
                waiting[edge.target().index()] -= 1;
            }
        }
        order
    }

    /// The producer that stands behind a port when passes that only forward are looked through; `None` if it is gone.
    fn behind(&self, fates: &[Fate], mut port: PortRef) -> Option<PortRef> {
        loop {
            match &fates[port.pass] {
                Fate::Runs => return Some(port),
                Fate::Gone(_) => return None,
                Fate::Forwards(_) => {
                    let pass = &self.passes[port.pass];
                    let wanted = pass.kind.info().outputs[port.port].resource;
                    let inputs = pass.kind.info().inputs.iter().zip(&pass.sources);
                    let source =
                        inputs.filter(|(info, _)| info.resource == wanted && !info.history).flat_map(|(_, sources)| sources).next();
                    port = *source?;
                }
            }
        }
    }

    fn prune(&self, traits: &W::Traits, roots: &[PortRef], order: &[usize]) -> Pruning {
        let mut fates: Vec<Fate> = self
            .passes
            .iter()
            .map(|pass| match pass.kind.need(pass.params.as_ref(), traits) {
                Need::Run => Fate::Runs,
                Need::Forward(reason) => Fate::Forwards(reason),
                Need::Omit(reason) => Fate::Gone(reason),
            })
            .collect();
        // A pass that starves can starve another's history, so this is repeated until nothing changes.
        loop {
            let mut changed = false;
            for &index in order {
                if matches!(fates[index], Fate::Gone(_)) {
                    continue;
                }
                if let Some(reason) = self.starved(&fates, index) {
                    fates[index] = Fate::Gone(reason);
                    changed = true;
                }
            }
            if !changed {
                break;
            }
        }
        let mut used = vec![false; self.passes.len()];
        let mut open: Vec<usize> = roots.iter().filter_map(|root| self.behind(&fates, *root)).map(|port| port.pass).collect();
        while let Some(index) = open.pop() {
            if std::mem::replace(&mut used[index], true) {
                continue;
            }
            let sources = self.passes[index].sources.iter().flatten();
            open.extend(sources.filter_map(|source| self.behind(&fates, *source)).map(|port| port.pass));
        }
        for (fate, used) in fates.iter_mut().zip(used) {
            if matches!(fate, Fate::Runs) && !used {
                *fate = Fate::Gone("nothing that the output needs reads what it makes".into());
            }
        }
        Pruning { fates }
    }

    fn starved(&self, fates: &[Fate], index: usize) -> Option<String> {
        let pass: &WiredPass<W> = &self.passes[index];
        let ports = pass.kind.info().inputs.iter().zip(&pass.sources);
        let mut required = ports.filter(|(port, _)| port.arity == Arity::One);
        let (port, sources) = required.find(|(_, sources)| !sources.iter().any(|source| self.behind(fates, *source).is_some()))?;
        let source = sources.first().map_or("nothing", |source| self.passes[source.pass].name.as_str());
        Some(format!("its input `{}` would come from `{source}`, which is left out", port.name))
    }

    fn aliases(&self, pruning: &Pruning, made: &BTreeMap<PortRef, usize>) -> BTreeMap<String, usize> {
        let mut aliases = BTreeMap::new();
        for (pass, wired) in self.passes.iter().enumerate() {
            let outputs = &wired.kind.info().outputs;
            for (port, info) in outputs.iter().enumerate() {
                let found = self.behind(&pruning.fates, PortRef { pass, port }).and_then(|port| made.get(&port));
                if let Some(resource) = found {
                    aliases.insert(format!("{}.{}", wired.name, info.name), *resource);
                    if outputs.len() == 1 {
                        aliases.insert(wired.name.clone(), *resource);
                    }
                }
            }
        }
        aliases
    }
}

struct Pruning {
    fates: Vec<Fate>,
}

impl Pruning {
    fn dropped<W: World>(&self, wired: &Wired<W>) -> Vec<Dropped> {
        let pairs = wired.passes.iter().zip(&self.fates);
        pairs
            .filter_map(|(pass, fate)| {
                let (reason, forwards) = match fate {
                    Fate::Runs => return None,
                    Fate::Forwards(reason) => (reason, true),
                    Fate::Gone(reason) => (reason, false),
                };
                Some(Dropped { pass: pass.name.clone(), kind: pass.kind.info().name, reason: reason.clone(), forwards })
            })
            .collect()
    }
}

struct Planner<'a, W: World> {
    wired: &'a Wired<W>,
    options: &'a PlanOptions,
    traits: &'a W::Traits,
    pruning: &'a Pruning,
    passes: Vec<PlannedPass<W>>,
    resources: Vec<PlannedResource>,
    made: BTreeMap<PortRef, usize>,
}

impl<W: World> Planner<'_, W> {
    fn shape_all(&mut self, order: &[usize]) -> Result<(), Vec<Problem>> {
        let mut problems = Vec::new();
        let running: Vec<usize> = order.iter().copied().filter(|index| matches!(self.pruning.fates[*index], Fate::Runs)).collect();
        for index in &running {
            if let Err(problem) = self.shape(*index) {
                problems.push(problem);
                // Shapes of everything behind it are unknown now.
                break;
            }
        }
        if !problems.is_empty() {
            return Err(problems);
        }
        // Histories are wired last: their makers may come after their readers.
        for (position, index) in running.iter().enumerate() {
            let wired = &self.wired.passes[*index];
            for (port_index, port) in wired.kind.info().inputs.iter().enumerate().filter(|(_, port)| port.history) {
                let _ = port;
                let found: Vec<usize> = self.live_sources(wired, port_index);
                for resource in &found {
                    self.resources[*resource].history = true;
                }
                self.passes[position].inputs[port_index] = found;
            }
        }
        Ok(())
    }

    fn live_sources(&self, wired: &WiredPass<W>, port: usize) -> Vec<usize> {
        let live = wired.sources[port].iter().filter_map(|source| self.wired.behind(&self.pruning.fates, *source));
        live.filter_map(|source| self.made.get(&source).copied()).collect()
    }

    fn shape(&mut self, index: usize) -> Result<(), Problem> {
        let wired = &self.wired.passes[index];
        let info = wired.kind.info();
        let context =
            ErasedPlanContext { name: &wired.name, params: wired.params.as_ref(), traits: self.traits, extent: self.options.extent };
        let inputs: Vec<Vec<usize>> = info
            .inputs
            .iter()
            .enumerate()
            .map(|(port_index, port)| if port.history { Vec::new() } else { self.live_sources(wired, port_index) })
            .collect();
        let values: Vec<PortValue> = inputs
            .iter()
            .map(|resources| PortValue {
                shapes: resources.iter().map(|resource| self.resources[*resource].value()).collect(),
                parts: Vec::new(),
            })
            .collect();
        let shapes = wired.kind.shape(&context, &values).map_err(|error| {
            let port = error.port.map(|port| format!(", port `{port}`")).unwrap_or_default();
            let place = error.port.and_then(|port| info.inputs.iter().position(|info| info.name == port));
            let span = place.map_or(wired.span.clone(), |port| wired.port_spans[port].clone());
            Problem::at(span, format!("pass `{}` ({}){port}: {}", wired.name, info.name, error.message)).maybe_help(error.help)
        })?;
        let specialisations = wired.kind.specialise(&context, &values);
        let mut flags = Flags::default();
        for specialisation in &specialisations {
            flags.set(specialisation.flag, specialisation.on);
        }
        let maker = self.passes.len();
        let mut outputs = Vec::new();
        for (port, shape) in shapes.into_iter().enumerate() {
            let port_info = &info.outputs[port];
            let Some(shape) = shape.into_iter().next() else { continue };
            let parts = (port_info.resource.parts)(shape.as_ref());
            self.made.insert(PortRef { pass: index, port }, self.resources.len());
            outputs.push(self.resources.len());
            self.resources.push(PlannedResource {
                name: format!("{}.{}", wired.name, port_info.name),
                type_name: port_info.resource.name,
                maker,
                last_use: maker,
                history: false,
                kept: false,
                parts,
                slots: Vec::new(),
                shape,
            });
        }
        self.passes.push(PlannedPass {
            kind: wired.kind.clone(),
            params: wired.params.boxed_clone(),
            flags,
            name: wired.name.clone(),
            claim: wired.kind.claim(wired.params.as_ref(), self.traits),
            specialisations,
            warnings: wired.kind.warnings(&context, &values),
            inputs,
            outputs,
        });
        Ok(())
    }

    /// The resource behind a root, or why it is gone.
    fn kept_resource(&self, root: PortRef) -> Result<usize, Problem> {
        let found = self.wired.behind(&self.pruning.fates, root).and_then(|port| self.made.get(&port));
        found.copied().ok_or_else(|| {
            let pass = &self.wired.passes[root.pass];
            let name = format!("{}.{}", pass.name, pass.kind.info().outputs[root.port].name);
            let reason = match &self.pruning.fates[root.pass] {
                Fate::Gone(reason) | Fate::Forwards(reason) => reason.clone(),
                Fate::Runs => "it is not made".into(),
            };
            let what = format!("this scene does not make `{name}`: pass `{}` is left out because {reason}", pass.name);
            let help = "`lobelia explain` shows what is kept and what is dropped; choose another output or another scene";
            if root == self.wired.output {
                Problem::at(self.wired.file.output.span.clone(), what).help(help)
            } else {
                Problem::on_command_line(what).help(help)
            }
        })
    }
}

fn mark_uses<W: World>(passes: &[PlannedPass<W>], resources: &mut [PlannedResource], kept: &[usize]) {
    for (position, pass) in passes.iter().enumerate() {
        for resource in pass.inputs.iter().flatten() {
            resources[*resource].last_use = resources[*resource].last_use.max(position);
        }
    }
    for resource in kept {
        resources[*resource].kept = true;
        resources[*resource].last_use = passes.len();
    }
}

/// Gives every part a slot. A slot is free again after the last reader of what is in it; only parts of equal kind share, and a history never does.
fn allocate<W: World>(passes: &[PlannedPass<W>], resources: &mut [PlannedResource], reuse: bool) -> Vec<Slot> {
    let mut slots: Vec<Slot> = Vec::new();
    // Position after which a slot is free; `None` for never.
    let mut free_after: Vec<Option<usize>> = Vec::new();
    for (position, pass) in passes.iter().enumerate() {
        for resource_index in &pass.outputs {
            let resource = &mut resources[*resource_index];
            let sides = if resource.history { 2 } else { 1 };
            for _ in 0..sides {
                for part in resource.parts.clone() {
                    let shared = reuse && !resource.history;
                    let found = (0..slots.len())
                        .find(|slot| shared && slots[*slot].kind == part.kind && free_after[*slot].is_some_and(|after| after < position));
                    let slot = found.unwrap_or_else(|| {
                        slots.push(Slot { kind: part.kind.clone(), bytes: part.bytes(), users: Vec::new() });
                        free_after.push(None);
                        slots.len() - 1
                    });
                    slots[slot].users.push((*resource_index, part.name));
                    free_after[slot] = shared.then_some(resource.last_use);
                    resource.slots.push(slot);
                }
            }
        }
    }
    slots
}
