//! All mistakes of a graph file at once, each once, and what variants take out of a chain.
#![allow(missing_docs, clippy::unwrap_used)]

mod common;

use common::*;
use lobelia_graph::{GraphFile, PlanOptions};

/// One mistake in each line that ends in a number.
const MISTAKES: &str = r#"(
    passes: {
        "floor": surface(),
        "shadow": shadow(),
        "lost": shadw(),                                            // 1: no such kind
        "shade": filter(from: {"light": "lost.light"}),
        "lamp": toy_lamp(cuont: 3, from: {"shade": "shadow.shade"}), // 2: no such parameter
        "beam": toy_lamp(count: 65, from: {"shade": "shadow.shade"}), // 3: out of range
        "sum": sum(from: {"terms": ["lamp.light", "baem.light"]}),  // 4: no such pass
        "blur": filter(from: {"light": "floor.surface"}),           // 5: another type
        "show": show(from: {"light": "sum.light"}),
    },
    output: "show.picture", // 6: no such output
    variants: {
        "dim": {"lamp": toy_lamp(count: "few", from: {"shade": "shadow.shade"})}, // 7: another type of value
        "none": {"lmap": none},                                     // 8: no such pass to replace
        "round": {"sum": filter(from: {"light": "show2.light"})},   // 9: no such pass, in a variant
        "fine": {"beam": toy_lamp(count: 2, from: {"shade": "shadow.shade"})},
    },
)"#;

#[test]
fn nine_mistakes_are_nine_messages() {
    let graph = GraphFile::parse(MISTAKES, "test.ron").unwrap();
    let problems = graph.check(&registry(), &mut |_| Ok(())).unwrap_err();
    let lines: Vec<usize> = problems.problems.iter().map(|problem| problems.position(problem.span.clone().unwrap().start).0).collect();
    let planted: Vec<usize> = MISTAKES
        .lines()
        .enumerate()
        .filter(|(_, line)| line.split("// ").nth(1).is_some_and(|comment| comment.starts_with(|first: char| first.is_ascii_digit())))
        .map(|(index, _)| index + 1)
        .collect();
    let mut sorted = lines.clone();
    sorted.sort_unstable();
    assert_eq!(planted.len(), 9);
    assert_eq!(sorted, planted, "{problems}");
    let text = problems.to_string();
    for part in
        ["`shadw`", "`cuont`", "65", "`baem.light`", "expected Light", "`show.picture`", "variant `dim`", "`lmap`", "variant `round`"]
    {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn what_is_wrong_as_it_is_written_comes_with_the_rest() {
    let text = r#"(
        passes: {"floor": surface(), "floor": shadow(), "shadow": shadow(), "lamp": (count: 3), "show": show(from: {"light": "lamp.light"}), "a.b": surface()},
        otuput: "show",
        output: "shwo",
    )"#;
    let problems = problems(GraphFile::parse(text, "test.ron").and_then(|graph| graph.check(&registry(), &mut |_| Ok(()))));
    assert_eq!(problems.matches("test.ron:").count() - problems.matches("first written here").count(), 5, "{problems}");
    for part in ["duplicate pass `floor`", "`lamp` has no kind", "cannot be called `a.b`", "no section `otuput`", "there is no `shwo`"] {
        assert!(problems.contains(part), "{part}: {problems}");
    }
}

#[test]
fn a_good_file_is_good_with_all_its_variants() {
    let graph = GraphFile::parse(CHAIN, "test.ron").unwrap();
    let mut looked_at = Vec::new();
    let count = graph.check(&registry(), &mut |wired| {
        looked_at.push(wired.variants.join("+"));
        Ok(())
    });
    assert_eq!(count.unwrap(), 4);
    assert_eq!(looked_at, ["", "sharp", "bare", "plain", "again"]);
}

const CHAIN: &str = r#"(
    passes: {
        "floor": surface(), "shadow": shadow(), "lamp": toy_lamp(),
        "blur": filter(from: {"light": "lamp.light"}), "soften": filter(from: {"light": "blur.light"}),
        "sum": sum(from: {"terms": ["lamp.light", "soften"]}), "show": show(from: {"light": "sum.light"}),
    },
    output: "show.screen",
    variants: {
        "sharp": {"soften": none},
        "bare": {"soften": none, "blur": none},
        "plain": {"sum": none, "show": show(from: {"light": "soften.light"})},
        "again": {"blur": filter(count: 2, from: {"light": "lamp.light"})},
    },
)"#;

#[test]
fn a_filter_that_is_taken_out_hands_its_input_on() {
    let graph = GraphFile::parse(CHAIN, "test.ron").unwrap();
    let fed = |variants: &[&str], reader: &str| -> Vec<String> {
        let variants: Vec<String> = variants.iter().map(|name| (*name).to_owned()).collect();
        let wired = graph.wire(&registry(), &variants, &[]).unwrap();
        let plan = wired.plan(&LIT, &PlanOptions::new([8, 4])).unwrap();
        let pass = plan.passes.iter().find(|pass| pass.name == reader).unwrap();
        pass.inputs.iter().flatten().map(|index| plan.resources[*index].name.clone()).collect()
    };
    assert_eq!(fed(&[], "sum"), ["lamp.light", "soften.light"]);
    assert_eq!(fed(&["sharp"], "sum"), ["lamp.light", "blur.light"]);
    // A whole chain is followed to its beginning.
    assert_eq!(fed(&["bare"], "sum"), ["lamp.light", "lamp.light"]);
    // A later variant may put back what an earlier one took out.
    assert_eq!(fed(&["bare", "again"], "sum"), ["lamp.light", "blur.light"]);
}

#[test]
fn what_has_no_single_input_of_that_type_hands_nothing_on() {
    let with = |pass: &str| {
        let text = CHAIN
            .replace(r#""again": {"blur": filter(count: 2, from: {"light": "lamp.light"})}"#, &format!(r#""again": {{"{pass}": none}}"#));
        GraphFile::parse(&text, "test.ron").unwrap().wire(&registry(), &["again".into()], &[])
    };
    // A sum has a list of inputs, a lamp none of the type that it makes.
    for pass in ["sum", "lamp"] {
        let text = problems(with(pass));
        assert!(text.contains(&format!("takes `{pass}` out")), "{text}");
    }
    assert!(with("blur").is_ok());
}
