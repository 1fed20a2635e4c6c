//! Which light the truth of a comparison holds, what each technique leaves out of it, and how much that is.

use crate::html::{escape, number};
use serde::{Deserialize, Serialize};

/// Light of one class, after some numbers of scattering events.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightPart {
    /// `punctual`, `area`, `emissive` or `environment`.
    pub class: String,
    /// Numbers of scattering events, rising: 0 is seen directly, 1 direct light, 2 one bounce.
    pub scatterings: Vec<u32>,
    /// The same for people.
    pub words: String,
}

/// What one technique casts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TechniqueLight {
    /// Name of the technique.
    pub technique: String,
    /// By the word of its passes, lights that the scene lacks left out.
    pub claim: Vec<LightPart>,
    /// Passes that make radiance and do not state which light it is: the claim is incomplete where there is one.
    pub silent: Vec<String>,
}

/// Light that a technique and the truth do not share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Missing {
    /// Name of the technique.
    pub technique: String,
    /// Which light.
    pub what: LightPart,
    /// Its share of the mean radiance of the truth, in [0, 1]; none where it is not known.
    pub share: Option<f64>,
}

/// Light of the scene that neither the truth holds nor a technique casts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Which light.
    pub what: LightPart,
    /// Its share of the mean radiance of the truth with all that is left out, in [0, 1]; none where it is not known.
    pub share: Option<f64>,
}

/// The light of a comparison.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// What the truth holds; none where it is a file, whose light is not known.
    pub held: Option<Vec<LightPart>>,
    /// What each technique casts.
    pub techniques: Vec<TechniqueLight>,
    /// What the truth holds and a technique does not cast.
    pub missing: Vec<Missing>,
    /// What a technique casts and the truth does not hold.
    pub extra: Vec<Missing>,
    /// What no one looks at.
    pub left_out: Vec<LeftOut>,
}

fn percent(share: f64) -> String {
    if share > 0.0 && share < 5e-4 { "less than 0.1 %".to_owned() } else { format!("{} %", number(share * 100.0)) }
}

fn list(parts: &[LightPart]) -> String {
    if parts.is_empty() { "no light".to_owned() } else { parts.iter().map(|part| part.words.as_str()).collect::<Vec<_>>().join(", ") }
}

impl Light {
    /// What a reader of the verdict must know, one sentence each; the same on the page and in the terminal.
    pub fn sentences(&self) -> Vec<String> {
        let mut sentences = Vec::new();
        match &self.held {
            Some(held) => sentences.push(format!("The truth holds {}.", list(held))),
            None => {
                let casts = self.techniques.iter().map(|one| format!("“{}” casts {}", one.technique, list(&one.claim)));
                let casts = casts.collect::<Vec<_>>().join("; ");
                sentences.push(format!("The reference is a file: which light it holds is not known. {casts}."));
            }
        }
        for one in self.techniques.iter().filter(|one| !one.silent.is_empty()) {
            let silent = one.silent.iter().map(|pass| format!("`{pass}`")).collect::<Vec<_>>().join(", ");
            sentences.push(format!(
                "“{}”: {silent} makes radiance but does not state which light it casts, so what is missing is not known.",
                one.technique
            ));
        }
        self.tell(&self.missing, "does not cast", "No technique casts", " of the truth", &mut sentences);
        self.tell(&self.extra, "also casts", "All techniques also cast", "", &mut sentences);
        if !self.left_out.is_empty() {
            let parts = self.left_out.iter().map(|part| {
                let share = part.share.map(|share| format!(": {} of all light", percent(share))).unwrap_or_default();
                format!("{}{share}", part.what.words)
            });
            let parts = parts.collect::<Vec<_>>().join("; ");
            sentences.push(format!("Not compared, since no technique casts it: {parts}. --lights all takes it into the truth."));
        }
        sentences
    }

    fn tell(&self, parts: &[Missing], verb: &str, all: &str, of: &str, sentences: &mut Vec<String>) {
        let mut told: Vec<&LightPart> = Vec::new();
        for part in parts {
            if told.contains(&&part.what) {
                continue;
            }
            told.push(&part.what);
            let who: Vec<&Missing> = parts.iter().filter(|other| other.what == part.what).collect();
            let names = who.iter().map(|one| format!("“{}”", one.technique)).collect::<Vec<_>>().join(", ");
            let share = part.share.map(|share| format!(": {}{of}", percent(share))).unwrap_or_default();
            let not_held = if of.is_empty() { ", which the truth does not hold" } else { "" };
            sentences.push(match who.len() == self.techniques.len() && who.len() > 1 {
                true => format!("{all} {}{not_held}{share}.", part.what.words),
                false => format!("{names} {verb} {}{not_held}{share}.", part.what.words),
            });
        }
    }

    /// Whether the verdict is about less or more than what the techniques cast.
    fn is_uneven(&self) -> bool {
        self.held.is_none()
            || !self.missing.is_empty()
            || !self.extra.is_empty()
            || self.techniques.iter().any(|one| !one.silent.is_empty())
    }
}

/// The sentences as a list; what is uneven stands out.
pub(crate) fn light_box(light: &Light, heading: &str) -> String {
    let items: String = light.sentences().iter().map(|sentence| format!("<li>{}</li>", escape(sentence))).collect();
    let class = if light.is_uneven() { "light uneven" } else { "light" };
    format!("<section class=\"{class}\"><h3>{}</h3><ul>{items}</ul></section>\n", escape(heading))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(class: &str, scatterings: &[u32], words: &str) -> LightPart {
        LightPart { class: class.to_owned(), scatterings: scatterings.to_vec(), words: words.to_owned() }
    }

    fn light() -> Light {
        let (spot, quad) =
            (part("punctual", &[1, 2], "punctual lights (direct light, one bounce)"), part("area", &[1], "area lights (direct light)"));
        let technique = |name: &str| TechniqueLight { technique: name.to_owned(), claim: vec![spot.clone()], silent: Vec::new() };
        let missing = |name: &str| Missing { technique: name.to_owned(), what: quad.clone(), share: Some(0.25) };
        Light {
            held: Some(vec![spot.clone(), quad.clone()]),
            techniques: vec![technique("a"), technique("b")],
            missing: vec![missing("a"), missing("b")],
            extra: Vec::new(),
            left_out: Vec::new(),
        }
    }

    #[test]
    fn what_is_missing_is_said_with_its_share() {
        let both = light();
        assert_eq!(both.sentences()[1], "No technique casts area lights (direct light): 25.0 % of the truth.");
        assert!(both.is_uneven() && light_box(&both, "Light").contains("uneven"));
        let mut one = light();
        one.missing.pop();
        assert_eq!(one.sentences()[1], "“a” does not cast area lights (direct light): 25.0 % of the truth.");
        let mut even = light();
        even.missing.clear();
        assert_eq!(even.sentences(), ["The truth holds punctual lights (direct light, one bounce), area lights (direct light)."]);
        assert!(!even.is_uneven());
    }

    #[test]
    fn what_is_not_known_is_said() {
        let file = Light { held: None, missing: Vec::new(), ..light() };
        assert!(file.sentences()[0].contains("which light it holds is not known") && file.is_uneven());
        let mut silent = light();
        silent.techniques[1].silent.push("fog (fog)".to_owned());
        assert!(silent.sentences()[1].starts_with("“b”: `fog (fog)` makes radiance but does not state"));
        let left = Light {
            missing: Vec::new(),
            left_out: vec![LeftOut { what: part("area", &[1], "area lights"), share: Some(1e-5) }],
            ..light()
        };
        assert!(left.sentences()[1].contains("area lights: less than 0.1 % of all light") && left.sentences()[1].contains("--lights all"));
    }

    #[test]
    fn names_from_outside_stay_text() {
        let mut hostile = light();
        hostile.missing[0].technique = "<script>".to_owned();
        hostile.missing.pop();
        assert!(!light_box(&hostile, "Light").contains("<script>"));
    }
}
