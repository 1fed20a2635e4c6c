//! The arguments of the default picture, and what further arguments change about them.

use std::ffi::{OsStr, OsString};
use std::path::PathBuf;

/// An option of `lobelia render` with the value it has unless the user gives another.
struct Preset {
    long: &'static str,
    short: Option<char>,
    value: &'static str,
}

const GRAPH: &str = "graphs/indirect.ron";
const SCENE: Preset = Preset { long: "--scene", short: None, value: "builtin:cornell-glossy" };
const SIZE: Preset = Preset { long: "--size", short: None, value: "480x480" };
const OUTPUT: Preset = Preset { long: "--output", short: Some('o'), value: "out.png" };

/// Short options of `lobelia render` without a value, which may stand before another in one argument: `-qo out.png`.
const SHORT_FLAGS: [char; 1] = ['q'];

/// Arguments of `lobelia render`: the graph, each default that `extra` does not give, then `extra`.
///
/// A default that is given again must go, because the program refuses an option that stands twice.
pub fn arguments(extra: &[OsString]) -> Vec<OsString> {
    let mut arguments = vec![OsString::from(GRAPH)];
    for default in [SCENE, SIZE, OUTPUT] {
        if default.given(extra).is_none() {
            arguments.push(default.short.map_or_else(|| default.long.into(), |short| format!("-{short}").into()));
            arguments.push(default.value.into());
        }
    }
    arguments.extend_from_slice(extra);
    arguments
}

/// The file the picture is written to; `None` where `extra` ends before it names one.
pub fn output(extra: &[OsString]) -> Option<PathBuf> {
    OUTPUT.given(extra).unwrap_or_else(|| Some(OUTPUT.value.into())).map(PathBuf::from)
}

impl Preset {
    /// Whether `extra` gives this option, and with which value; `Some(None)` where the value is missing.
    fn given(&self, extra: &[OsString]) -> Option<Option<OsString>> {
        extra.iter().enumerate().find_map(|(index, argument)| {
            let attached = self.attached_value(argument)?;
            Some(if attached.is_empty() { extra.get(index + 1).cloned() } else { Some(attached) })
        })
    }

    /// What follows this option within one argument, empty if nothing does; `None` if the argument is not this option.
    fn attached_value(&self, argument: &OsStr) -> Option<OsString> {
        let text = argument.to_str()?;
        if let Some(rest) = text.strip_prefix(self.long) {
            return if rest.is_empty() { Some(OsString::new()) } else { rest.strip_prefix('=').map(OsString::from) };
        }
        let cluster = text.strip_prefix('-')?.trim_start_matches(SHORT_FLAGS);
        let rest = cluster.strip_prefix(self.short?)?;
        Some(rest.strip_prefix('=').unwrap_or(rest).into())
    }
}

#[cfg(test)]
mod tests {
    use super::{arguments, output};
    use std::ffi::OsString;
    use std::path::PathBuf;

    fn words(text: &str) -> Vec<OsString> {
        text.split_whitespace().map(OsString::from).collect()
    }

    #[test]
    fn without_further_arguments_every_default_is_given() {
        let expected = words("graphs/indirect.ron --scene builtin:cornell-glossy --size 480x480 -o out.png");
        assert_eq!(arguments(&[]), expected);
        assert_eq!(output(&[]), Some(PathBuf::from("out.png")));
    }

    #[test]
    fn every_spelling_of_an_option_replaces_its_default() {
        for given in ["-o a.png", "-oa.png", "-o=a.png", "-qo a.png", "--output a.png", "--output=a.png", "--seed 3 -o a.png"] {
            let extra = words(given);
            let expected = [words("graphs/indirect.ron --scene builtin:cornell-glossy --size 480x480"), extra.clone()].concat();
            assert_eq!(arguments(&extra), expected, "{given}");
            assert_eq!(output(&extra), Some(PathBuf::from("a.png")), "{given}");
        }
        let extra = words("--scene=room.gltf --size 64x64");
        assert_eq!(arguments(&extra), words("graphs/indirect.ron -o out.png --scene=room.gltf --size 64x64"));
    }

    #[test]
    fn options_that_only_begin_alike_replace_nothing() {
        let extra = words("--outputs x --sizes 3 -q");
        let expected = "graphs/indirect.ron --scene builtin:cornell-glossy --size 480x480 -o out.png --outputs x --sizes 3 -q";
        assert_eq!(arguments(&extra), words(expected));
    }

    #[test]
    fn an_option_without_its_value_is_left_for_the_program_to_refuse() {
        let extra = words("-o");
        assert_eq!(output(&extra), None);
        assert_eq!(arguments(&extra).iter().filter(|argument| *argument == "-o").count(), 1);
    }
}
