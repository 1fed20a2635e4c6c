//! What the variants of a graph file are for, and what each puts in the place of what.

use lobelia_graph::file::{GraphFile, PassEntry, Replacement};
use serde::Serialize;

/// A variant of a graph file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Variant {
    /// Its name.
    pub name: String,
    /// The `//` lines directly above its name in the file, without the slashes; empty where there are none.
    pub doc: String,
    /// What it replaces, in the order of the file.
    pub changes: Vec<Change>,
}

/// What a variant does to one pass.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Change {
    /// Name of the pass.
    pub pass: String,
    /// Its kind in the base graph; nothing if the variant adds the pass.
    pub before: Option<String>,
    /// Its kind in the variant; nothing if the variant takes the pass out.
    pub after: Option<String>,
    /// Parameters that the base graph and the variant write differently.
    pub params: Vec<ParamChange>,
}

/// A parameter as both sides write it. A value that a side does not write is the default of that side's kind.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ParamChange {
    /// Name of the parameter.
    pub name: String,
    /// Value in the base graph; nothing if it is not written there.
    pub before: Option<String>,
    /// Value in the variant; nothing if it is not written there.
    pub after: Option<String>,
}

/// The variants of a graph file, in its order.
pub fn variants(graph: &GraphFile) -> Vec<Variant> {
    let variant = |(name, replacements): &(_, Vec<Replacement>)| {
        let name: &lobelia_graph::file::Spanned = name;
        let changes = replacements.iter().map(|replacement| change(graph, replacement)).collect();
        Variant { name: name.text.clone(), doc: comment_above(&graph.text, name.span.start), changes }
    };
    graph.variants.iter().map(variant).collect()
}

/// The whole lines of `//` comment directly above the line that holds `offset`.
fn comment_above(text: &str, offset: usize) -> String {
    let head = text.get(..offset).unwrap_or_default();
    // The last piece is the part of the name's own line that stands before it.
    let mut lines: Vec<&str> =
        head.split('\n').rev().skip(1).map_while(|line| line.trim().strip_prefix("//")).map(|line| line.trim_matches('/').trim()).collect();
    lines.reverse();
    lines.join("\n").trim().to_owned()
}

fn change(graph: &GraphFile, replacement: &Replacement) -> Change {
    let name = &replacement.name().text;
    let base = graph.passes.iter().find(|pass| pass.name.text == *name);
    let after = match replacement {
        Replacement::Pass(pass) => Some(pass),
        Replacement::Remove(_) => None,
    };
    let params = after.map(|after| params(base, after)).unwrap_or_default();
    let kind = |pass: &PassEntry| pass.kind.text.clone();
    Change { pass: name.clone(), before: base.map(kind), after: after.map(kind), params }
}

fn params(base: Option<&PassEntry>, after: &PassEntry) -> Vec<ParamChange> {
    // Parameters of another kind are other parameters, even under the same name, unless both sides write them.
    let same_kind = base.is_some_and(|base| base.kind.text == after.kind.text);
    let value = |pass: &PassEntry, name: &str| pass.params.iter().find(|(key, _)| key.text == name).map(|(_, value)| value.text.clone());
    let mut names: Vec<&str> = after.params.iter().map(|(key, _)| key.text.as_str()).collect();
    if let (true, Some(base)) = (same_kind, base) {
        for (key, _) in &base.params {
            if !names.contains(&key.text.as_str()) {
                names.push(&key.text);
            }
        }
    }
    let pair =
        |name: &str| ParamChange { name: name.to_owned(), before: base.and_then(|base| value(base, name)), after: value(after, name) };
    names.into_iter().map(pair).filter(|change| change.before != change.after).collect()
}

#[cfg(test)]
mod tests {
    use super::{ParamChange, variants};
    use lobelia_graph::GraphFile;

    const COMMENTED: &str = r#"(
    passes: {
        "lights": vpl_lights(count: 64),
        "visibility": visibility(),
    },
    output: "lights.lights",
    variants: {
        "plain": {"lights": vpl_lights(count: 64)}, // Not above a name.
        // Far from a name.

        // Two lines
        // of comment.
        "more": {"lights": vpl_lights(count: 128), "visibility": none},
        "other": {"lights": two_vsgl()},
    },
)"#;

    #[test]
    fn comments_and_changes_are_told() {
        let graph = GraphFile::parse(COMMENTED, "x.ron").unwrap_or_else(|problems| panic!("{problems}"));
        let list = variants(&graph);
        let docs: Vec<_> = list.iter().map(|variant| (variant.name.as_str(), variant.doc.as_str())).collect();
        assert_eq!(docs, [("plain", ""), ("more", "Two lines\nof comment."), ("other", "")]);
        assert!(list[0].changes[0].params.is_empty());
        let count = ParamChange { name: "count".into(), before: Some("64".into()), after: Some("128".into()) };
        assert_eq!(list[1].changes[0].params, [count]);
        assert_eq!((list[1].changes[1].before.as_deref(), list[1].changes[1].after.as_deref()), (Some("visibility"), None));
        assert_eq!(list[2].changes[0].after.as_deref(), Some("two_vsgl"));
    }

    #[test]
    fn the_shipped_graph_is_told() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../graphs/indirect.ron");
        let graph = GraphFile::load(path.as_ref()).unwrap_or_else(|problems| panic!("{problems}"));
        let list = variants(&graph);
        assert_eq!(list.len(), graph.variant_names().count());
        let interleaved = list.iter().find(|variant| variant.name == "interleaved").expect("a variant");
        assert!(interleaved.doc.starts_with("A sixteenth of the work"), "{}", interleaved.doc);
        let out = list.iter().find(|variant| variant.name == "no-visibility").expect("a variant");
        assert_eq!((out.changes[0].pass.as_str(), &out.changes[0].after), ("visibility", &None));
    }
}
