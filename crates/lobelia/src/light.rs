//! Like with like: which light a graph casts by the word of its passes, which lights of a scene nobody casts, and what the truth of a comparison holds.

use lobelia_frame::{LightClass, LightTransport, Radiance, SceneWorld};
use lobelia_graph::{Plan, Registry, Resource};
use lobelia_reference::LightPaths;
use lobelia_report::{LeftOut, Light, LightPart, Missing, TechniqueLight};
use lobelia_scene::SceneTraits;

/// Scattering events of the truth's paths where nothing says how many: direct light and one bounce.
pub const DEPTH: u32 = 2;

/// What a picture holds by the word of the passes that it is made from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Claim {
    /// The light of lights that the scene has.
    pub light: LightTransport,
    /// Passes that make radiance out of no other radiance and state nothing, as `name (kind)`: the light is incomplete where there is one.
    pub silent: Vec<String>,
}

impl Claim {
    /// What a resource of a plan holds.
    pub fn of(plan: &Plan<SceneWorld>, resource: usize) -> Self {
        let is_radiance = |port: &lobelia_graph::PortInfo| port.resource.name == Radiance::NAME;
        let behind = plan.behind(resource).into_iter().map(|pass| &plan.passes[pass]);
        let silent = behind.filter(|pass| {
            let begins = pass.output_ports().iter().any(is_radiance) && !pass.input_ports().iter().any(is_radiance);
            // A sum without terms has inputs and casts nothing.
            begins && pass.claim.is_none()
        });
        let silent = silent.map(|pass| format!("{} ({})", pass.name, pass.kind_name())).collect();
        Self { light: plan.claim(resource).within(plan.traits()), silent }
    }

    /// What is compared: a resource by name, or what the graph ends in.
    pub fn of_output(plan: &Plan<SceneWorld>, output: Option<&str>) -> Self {
        Self::of(plan, output.and_then(|name| plan.find(name)).unwrap_or(plan.output))
    }

    /// What is kept of a plan, taken together.
    pub fn of_all(plan: &Plan<SceneWorld>) -> Self {
        let kept = (0..plan.resources.len()).filter(|index| plan.resources[*index].kept);
        kept.map(|index| Self::of(plan, index)).fold(Self::default(), |mut sum, one| {
            sum.light |= one.light;
            sum.silent.extend(one.silent);
            sum.silent.dedup();
            sum
        })
    }
}

/// Classes of lights by name: `all`, or some, separated by commas.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Lights(Vec<LightClass>);

impl Lights {
    /// Only their part of some light.
    pub fn of(&self, paths: LightPaths) -> LightPaths {
        // What holds all lights keeps its name, and so its place among the kept references.
        if self.0.len() == LightClass::ALL.len() {
            paths
        } else {
            LightPaths::Only(paths.transport().only(|class| self.0.contains(&class)))
        }
    }
}

impl std::str::FromStr for Lights {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text.trim() == "all" {
            return Ok(Self(LightClass::ALL.to_vec()));
        }
        let mut classes = text
            .split(',')
            .map(|name| name.trim().parse())
            .collect::<Result<Vec<LightClass>, _>>()
            .map_err(|error| format!("{error}, all"))?;
        classes.sort_unstable();
        classes.dedup();
        Ok(Self(classes))
    }
}

impl TryFrom<String> for Lights {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

impl From<Lights> for String {
    fn from(lights: Lights) -> Self {
        match lights.0.len() == LightClass::ALL.len() {
            true => "all".to_owned(),
            false => lights.0.iter().map(|class| class.name()).collect::<Vec<_>>().join(","),
        }
    }
}

/// The light of the truth: what is asked for, or else the union of what the techniques claim. Where a technique does not say what it casts, or all of them cast
/// nothing, all light up to [`DEPTH`] scattering events.
pub fn truth_paths(asked: Option<LightPaths>, claims: &[Claim]) -> LightPaths {
    let union = claims.iter().fold(LightTransport::nothing(), |sum, claim| sum | claim.light);
    let known = claims.iter().all(|claim| claim.silent.is_empty()) && !union.is_nothing();
    asked.unwrap_or(if known { LightPaths::Only(union) } else { LightPaths::Full { depth: DEPTH } })
}

fn part(class: LightClass, light: &LightTransport) -> LightPart {
    LightPart { class: class.name().to_owned(), scatterings: light.counts(class).collect(), words: light.to_string() }
}

fn parts(light: &LightTransport) -> Vec<LightPart> {
    light.parts().map(|(class, part_of)| part(class, &part_of)).collect()
}

/// Compares what the truth holds (`None`: a file) with what techniques claim. `mean` is the mean radiance of some light of the scene; it is asked only for what is
/// missing, left out or too much, and for what the truth holds then.
pub fn compare<E>(
    truth: Option<&LightPaths>,
    techniques: &[(&str, &Claim)],
    traits: &SceneTraits,
    mean: &mut dyn FnMut(&LightTransport) -> Result<f64, E>,
) -> Result<Light, E> {
    let technique = |(name, claim): &(&str, &Claim)| TechniqueLight {
        technique: (*name).to_owned(),
        claim: parts(&claim.light),
        silent: claim.silent.clone(),
    };
    let mut light = Light { techniques: techniques.iter().map(technique).collect(), ..Light::default() };
    let Some(held) = truth.map(|paths| paths.transport().within(traits)) else { return Ok(light) };
    light.held = Some(parts(&held));
    let share = |part: f64, whole: f64| (whole > 0.0).then(|| part / whole);
    for (name, claim) in techniques {
        // What a silent pass casts is not known, so nothing can be said to be missing.
        if claim.silent.is_empty() {
            for (class, missing) in held.without(&claim.light).parts() {
                let share = share(mean(&missing)?, mean(&held)?);
                light.missing.push(Missing { technique: (*name).to_owned(), what: part(class, &missing), share });
            }
        }
        for (class, extra) in claim.light.without(&held).parts() {
            light.extra.push(Missing { technique: (*name).to_owned(), what: part(class, &extra), share: None });
        }
    }
    let cast = techniques.iter().fold(held, |sum, (_, claim)| sum | claim.light);
    let depth = cast.depth().unwrap_or(0).max(DEPTH);
    // Classes whose light is scattered by a technique are compared; how far is the techniques' choice.
    let rest = LightTransport::of_all(0..=depth).within(traits).only(|class| cast.counts(class).all(|count| count == 0)).without(&cast);
    for (class, left) in rest.parts() {
        let share = share(mean(&left)?, mean(&held)? + mean(&rest)?);
        light.left_out.push(LeftOut { what: part(class, &left), share });
    }
    Ok(light)
}

/// Which lights of the scene a picture does not have, in sentences.
pub fn uncast(claim: &Claim, traits: &SceneTraits) -> Vec<String> {
    let mut sentences: Vec<String> = LightClass::ALL
        .into_iter()
        .filter(|class| traits.lights_of(*class) > 0 && claim.light.counts(*class).all(|count| count == 0))
        .map(|class| {
            let lights = counted(class, traits.lights_of(class));
            match (claim.light.has(class, 0), class) {
                (true, _) => format!("no pass of this graph casts the light of {lights}: seen directly, but lighting nothing"),
                (false, LightClass::Punctual) => format!("no pass of this graph casts the light of {lights}"),
                (false, _) => format!("no pass of this graph casts the light of {lights}, nor is it seen directly"),
            }
        })
        .collect();
    if !claim.silent.is_empty() && !sentences.is_empty() {
        let silent = claim.silent.join(", ");
        sentences.push(format!(
            "{silent} makes radiance but does not state which light it casts (`Pass::claim`): it may cast what is named here"
        ));
    } else if claim.silent.is_empty() && !(1..=LightTransport::MOST).any(|count| claim.light.has_any(count)) {
        sentences.push("the scene has no light that a pass of this graph casts; only emission and background are seen".to_owned());
    }
    sentences
}

/// "2 area lights", "1 emissive surface", "the environment".
pub fn counted(class: LightClass, count: usize) -> String {
    match class {
        LightClass::Environment => "the environment".to_owned(),
        _ => format!("{count} {}", if count == 1 { class.words().trim_end_matches('s') } else { class.words() }),
    }
}

/// For each class of lights that a scene has, the registered passes that scatter its light, with their defaults.
pub fn casters(registry: &Registry<SceneWorld>, traits: &SceneTraits) -> Vec<(LightClass, Vec<&'static str>)> {
    let claims = registry.claims(traits);
    let casts = |class: LightClass| {
        let passes = claims.iter().filter(|(_, claim)| claim.counts(class).any(|count| count > 0)).map(|(name, _)| *name);
        (class, passes.collect())
    };
    LightClass::ALL.into_iter().filter(|class| traits.lights_of(*class) > 0).map(casts).collect()
}
