//! Which light a picture holds: from which sources, after how many scattering events.

use crate::SceneTraits;
use serde::{Deserialize, Serialize};
use std::{fmt, ops};

/// Sources of light, told apart by how techniques find them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LightClass {
    /// Point, spot and directional lights: no ray meets them.
    Punctual,
    /// Lights of `extras.area_light`: quads, disks, spheres and polygons of uniform radiance.
    Area,
    /// Surfaces whose material emits, other than those of area lights.
    Emissive,
    /// The environment map.
    Environment,
}

impl LightClass {
    /// All of them, in the order of every list.
    pub const ALL: [LightClass; 4] = [Self::Punctual, Self::Area, Self::Emissive, Self::Environment];

    /// One word, as it is written on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Punctual => "punctual",
            Self::Area => "area",
            Self::Emissive => "emissive",
            Self::Environment => "environment",
        }
    }

    /// For people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Punctual => "punctual lights",
            Self::Area => "area lights",
            Self::Emissive => "emissive surfaces",
            Self::Environment => "environment",
        }
    }

    fn bit(self) -> usize {
        self as usize
    }
}

impl fmt::Display for LightClass {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

impl std::str::FromStr for LightClass {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names = || Self::ALL.map(Self::name).join(", ");
        Self::ALL.into_iter().find(|class| class.name() == text).ok_or_else(|| format!("`{text}` is none of {}", names()))
    }
}

impl SceneTraits {
    /// How many lights of a class the scene has; an environment map is one.
    pub fn lights_of(&self, class: LightClass) -> usize {
        match class {
            LightClass::Punctual => self.punctual_lights(),
            LightClass::Area => self.area_lights(),
            LightClass::Emissive => self.emissive_surfaces,
            LightClass::Environment => usize::from(self.environment),
        }
    }
}

/// Words that hold one bit for each number of scattering events.
const WORDS: usize = 16;

/// For every class of light, after how many scattering events its light counts.
///
/// 0 is light that the camera sees directly, 1 direct light (it scatters at one surface), 2 one bounce of indirect light, and so on up to
/// [`LightTransport::MOST`]. Punctual lights cannot be seen, so that 0 is never among theirs. As a claim of a pass it says what the pass *computes*, well or badly:
/// shadows are part of it, so a technique without shadows claims the same light as one with them, and is wrong about it.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct LightTransport([[u64; WORDS]; LightClass::ALL.len()]);

impl LightTransport {
    /// Most scattering events that can be told apart.
    pub const MOST: u32 = 64 * WORDS as u32 - 1;

    /// No light at all.
    pub fn nothing() -> Self {
        Self::default()
    }

    /// Light of one class. Counts above [`LightTransport::MOST`] are left out.
    pub fn of(class: LightClass, counts: impl IntoIterator<Item = u32>) -> Self {
        Self::nothing().and(class, counts)
    }

    /// The same counts for every class.
    pub fn of_all(counts: impl IntoIterator<Item = u32> + Clone) -> Self {
        LightClass::ALL.into_iter().fold(Self::nothing(), |sum, class| sum.and(class, counts.clone()))
    }

    /// With light of a class added.
    #[must_use]
    pub fn and(mut self, class: LightClass, counts: impl IntoIterator<Item = u32>) -> Self {
        for count in counts.into_iter().filter(|count| *count <= Self::MOST) {
            if (class, count) != (LightClass::Punctual, 0) {
                self.0[class.bit()][count as usize / 64] |= 1 << (count % 64);
            }
        }
        self
    }

    /// Whether light of a class that has scattered `count` times is in it.
    pub fn has(&self, class: LightClass, count: u32) -> bool {
        self.0[class.bit()].get(count as usize / 64).is_some_and(|word| word >> (count % 64) & 1 == 1)
    }

    /// Whether light of any class that has scattered `count` times is in it.
    pub fn has_any(&self, count: u32) -> bool {
        LightClass::ALL.into_iter().any(|class| self.has(class, count))
    }

    /// Numbers of scattering events of a class, rising.
    pub fn counts(&self, class: LightClass) -> impl Iterator<Item = u32> + '_ {
        (0..=Self::MOST).filter(move |count| self.has(class, *count))
    }

    /// Whether there is nothing in it.
    pub fn is_nothing(&self) -> bool {
        *self == Self::nothing()
    }

    /// Most scattering events of all classes; `None` if there is nothing in it.
    pub fn depth(&self) -> Option<u32> {
        LightClass::ALL.into_iter().filter_map(|class| self.counts(class).last()).max()
    }

    /// Only the light of some classes.
    #[must_use]
    pub fn only(&self, wanted: impl Fn(LightClass) -> bool) -> Self {
        LightClass::ALL.into_iter().filter(|class| wanted(*class)).fold(Self::nothing(), |mut kept, class| {
            kept.0[class.bit()] = self.0[class.bit()];
            kept
        })
    }

    /// Only the light of lights that a scene has.
    #[must_use]
    pub fn within(&self, traits: &SceneTraits) -> Self {
        let kept = self.only(|class| traits.lights_of(class) > 0);
        // Surfaces that are drawn in their colour are seen as those that emit, and light nothing.
        if traits.unlit && self.has(LightClass::Emissive, 0) { kept.and(LightClass::Emissive, [0]) } else { kept }
    }

    /// What is left when `other` is taken away.
    #[must_use]
    pub fn without(mut self, other: &Self) -> Self {
        for (word, taken) in self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()) {
            *word &= !taken;
        }
        self
    }

    /// The parts by class, those with nothing left out.
    pub fn parts(&self) -> impl Iterator<Item = (LightClass, Self)> + '_ {
        let part = |class| (class, self.only(|other| other == class));
        LightClass::ALL.into_iter().map(part).filter(|(_, part)| !part.is_nothing())
    }
}

impl ops::BitOrAssign for LightTransport {
    fn bitor_assign(&mut self, other: Self) {
        for (word, more) in self.0.as_flattened_mut().iter_mut().zip(other.0.as_flattened()) {
            *word |= more;
        }
    }
}

impl ops::BitOr for LightTransport {
    type Output = Self;

    fn bitor(mut self, other: Self) -> Self {
        self |= other;
        self
    }
}

/// One number of scattering events in words.
fn count_words(count: u32) -> String {
    match count {
        0 => "seen directly".to_owned(),
        1 => "direct light".to_owned(),
        2 => "one bounce".to_owned(),
        more => format!("{} bounces", more - 1),
    }
}

/// "punctual lights (direct light, one bounce), area lights (seen directly)"; every set has its own words.
impl fmt::Display for LightTransport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_nothing() {
            return formatter.write_str("no light");
        }
        for (index, (class, _)) in self.parts().enumerate() {
            let mut runs: Vec<(u32, u32)> = Vec::new();
            for count in self.counts(class) {
                match runs.last_mut() {
                    Some((_, end)) if *end + 1 == count => *end = count,
                    _ => runs.push((count, count)),
                }
            }
            let words: Vec<String> = runs
                .into_iter()
                .flat_map(|(first, last)| match last - first {
                    0 => vec![count_words(first)],
                    1 => vec![count_words(first), count_words(last)],
                    _ => vec![format!("{} to {}", count_words(first), count_words(last))],
                })
                .collect();
            write!(formatter, "{}{} ({})", if index > 0 { ", " } else { "" }, class.words(), words.join(", "))?;
        }
        Ok(())
    }
}

impl fmt::Debug for LightTransport {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "[{self}]")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_of_light_join_and_part() {
        use LightClass::{Area, Emissive, Environment, Punctual};
        let graph = LightTransport::of(Punctual, [1]) | LightTransport::of(Punctual, [2]) | LightTransport::of(Area, [0]);
        assert_eq!(graph, LightTransport::of(Punctual, 1..=2).and(Area, [0]));
        assert!(graph.has(Punctual, 2) && graph.has(Area, 0) && !graph.has(Area, 1) && !graph.has(Punctual, 0));
        assert!(graph.has_any(0) && graph.has_any(2) && !graph.has_any(3));
        let full = LightTransport::of_all(0..=1000);
        assert_eq!((full.depth(), graph.depth(), LightTransport::nothing().depth()), (Some(1000), Some(2), None));
        assert!(!full.has(Punctual, 0), "a light without extent cannot be seen");
        let rest = full.without(&graph);
        assert_eq!(rest.counts(Punctual).collect::<Vec<_>>(), (3..=1000).collect::<Vec<_>>());
        assert_eq!(rest.counts(Area).take(2).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(rest | graph, full);
        assert!(full.without(&full).is_nothing() && !full.has(Emissive, 4000) && LightTransport::of(Area, [4000]).is_nothing());
        let parts: Vec<_> = graph.parts().collect();
        assert_eq!(parts, [(Punctual, LightTransport::of(Punctual, 1..=2)), (Area, LightTransport::of(Area, [0]))]);
        assert_eq!(full.only(|class| class == Environment), LightTransport::of(Environment, 0..=1000));
    }

    #[test]
    fn every_set_has_its_own_words() {
        use LightClass::{Area, Environment, Punctual};
        for (set, words) in [
            (LightTransport::nothing(), "no light"),
            (LightTransport::of(Punctual, 1..=2).and(Area, [0]), "punctual lights (direct light, one bounce), area lights (seen directly)"),
            (LightTransport::of(Environment, (0..=6).filter(|count| *count != 1)), "environment (seen directly, one bounce to 5 bounces)"),
            (LightTransport::of(Area, [1, 3, 4]), "area lights (direct light, 2 bounces, 3 bounces)"),
        ] {
            assert_eq!(set.to_string(), words);
        }
        for class in LightClass::ALL {
            assert_eq!(class.name().parse(), Ok(class));
        }
        assert!("sun".parse::<LightClass>().is_err_and(|error| error.contains("punctual, area, emissive, environment")));
    }
}
