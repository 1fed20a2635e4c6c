//! The commands and the graph of README.md. `render` lines have graph, variants and settings wired by `explain`, which renders nothing;
//! lines that need no device run as they are; of the others, and of all flags, only the options are read. Pictures are not held.

use std::process::{Command, Output};

const README: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/../../README.md"));

fn blocks(language: &str) -> Vec<&'static str> {
    README.split(&format!("```{language}\n")).skip(1).filter_map(|rest| rest.split("\n```").next()).collect()
}

fn program(words: &[&str]) -> Output {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    Command::new(env!("CARGO_BIN_EXE_lobelia")).current_dir(root).args(words).output().expect("the program starts")
}

/// What the program has against a command, if anything.
fn fault(words: &[&str]) -> Option<String> {
    // Options are read from left to right, so help at the end is given only if all before it are good.
    let mut output = program(&[words, &["--help"]].concat());
    if output.status.success() && words[0] == "render" {
        let mut dry = vec!["explain", words[1]];
        for pair in words[2..].windows(2).filter(|pair| ["--variant", "--set"].contains(&pair[0])) {
            dry.extend(pair);
        }
        output = program(&dry);
    } else if output.status.success() && ["passes", "variants", "check", "explain", "scene-info"].contains(&words[0]) {
        output = program(words);
    }
    (!output.status.success()).then(|| String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn commands_are_accepted() {
    let mut seen = 0;
    for line in blocks("sh").iter().flat_map(|block| block.lines()) {
        let line = line.split('#').next().unwrap_or_default().trim();
        let rest = line.strip_prefix("cargo run -p lobelia-lobelia -- ").or_else(|| line.strip_prefix("lobelia "));
        let Some(rest) = rest else { continue };
        let words: Vec<&str> = rest.split_whitespace().collect();
        if let Some(fault) = fault(&words) {
            panic!("README.md: `{line}`: {fault}");
        }
        seen += 1;
    }
    assert!(seen > 10, "{seen} commands");
    assert!(fault(&["render", "graphs/indirect.ron", "--variant", "no-such-variant"]).is_some());
    assert!(fault(&["compare", "graphs/indirect.ron", "--no-such-flag"]).is_some());
    assert!(fault(&["passes", "no-such-pass"]).is_some());
}

#[test]
fn the_graph_is_good() {
    let list = blocks("ron");
    assert!(!list.is_empty());
    for (index, text) in list.iter().enumerate() {
        let path = std::env::temp_dir().join(format!("lobelia-readme-{}-{index}.ron", std::process::id()));
        std::fs::write(&path, text).expect("a file");
        let output = program(&["check", path.to_str().expect("a path")]);
        let _ = std::fs::remove_file(&path);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
}
