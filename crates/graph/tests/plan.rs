//! Planning, without a device: wiring, pruning, ordering, memory.
#![allow(clippy::unwrap_used)]

mod common;
use common::{DARK, DIFFUSE, LIT, names, plan, problems, wire};
use lobelia_graph::PlanOptions;

const BASE: &str = r#"(
    passes: {
        "floor": surface(),
        "shadow": shadow(),
        "lamp": toy_lamp(count: 8),
        "show": show(),
    },
    output: "show.screen",
    variants: {
        "open": {"shadow": none},
        "bright": {"lamp": toy_lamp(count: 32)},
        "many": {"lamp": toy_lamp(count: 33)},
    },
)"#;

#[test]
fn inputs_wire_themselves_by_type() {
    let plan = plan(BASE, &LIT).unwrap();
    assert_eq!(names(&plan), ["floor", "shadow", "lamp", "show"]);
    let lamp = &plan.passes[2];
    assert_eq!(lamp.inputs.iter().map(Vec::len).collect::<Vec<_>>(), [1, 1]);
    assert_eq!(plan.resources[lamp.inputs[0][0]].name, "floor.surface");
    assert_eq!(plan.resources[lamp.inputs[1][0]].name, "shadow.shade");
    assert_eq!(plan.resources[plan.output].name, "show.screen");
}

#[test]
fn a_pass_may_stand_anywhere_in_the_file() {
    let text = r#"(passes: {"show": show(), "lamp": toy_lamp(), "floor": surface()}, output: "show")"#;
    assert_eq!(names(&plan(text, &LIT).unwrap()), ["floor", "lamp", "show"]);
}

#[test]
fn variants_replace_and_remove() {
    let open = wire(BASE, &["open"], &[]).unwrap().plan(&LIT, &PlanOptions::new([8, 4])).unwrap();
    assert_eq!(names(&open), ["floor", "lamp", "show"]);
    assert!(open.passes[1].inputs[1].is_empty());
    let bright = wire(BASE, &["bright"], &[]).unwrap().plan(&LIT, &PlanOptions::new([8, 4])).unwrap();
    assert!(bright.passes[2].params_ron().contains("count:32"));
    let both = wire(BASE, &["bright", "open"], &[]).unwrap().plan(&LIT, &PlanOptions::new([8, 4])).unwrap();
    assert_eq!(names(&both), ["floor", "lamp", "show"]);
    assert!(both.passes[1].params_ron().contains("count:32"));
}

#[test]
fn overrides_come_after_variants() {
    let wired = wire(BASE, &["bright"], &["lamp.count=2", "lamp.clamp=none", "lamp.tilt=-1.5", "lamp.mode=lit"]).unwrap();
    let plan = wired.plan(&LIT, &PlanOptions::new([8, 4])).unwrap();
    let params = plan.passes[2].params_json();
    assert_eq!(params["count"], 2);
    assert_eq!(params["clamp"], "none");
    assert_eq!(params["tilt"], -1.5);
    let clamped = wire(BASE, &[], &["lamp.clamp=2.5"]).unwrap().plan(&LIT, &PlanOptions::new([8, 4])).unwrap();
    assert_eq!(clamped.passes[2].params_json()["clamp"], 2.5);
}

#[test]
fn what_the_scene_does_not_need_goes_with_what_only_fed_it() {
    let text = r#"(
        passes: {"floor": surface(), "shadow": shadow(), "lamp": toy_lamp(), "sum": sum(), "show": show(from: {"light": "sum.light"})},
        output: "show.screen",
    )"#;
    let dark = plan(text, &DARK).unwrap();
    assert_eq!(names(&dark), ["sum", "show"]);
    let reason = |pass: &str| dark.dropped.iter().find(|dropped| dropped.pass == pass).unwrap().reason.clone();
    assert_eq!(reason("lamp"), "the scene has no light");
    assert_eq!(reason("shadow"), "the scene has no light");
    assert!(reason("floor").contains("nothing that the output needs"));
    let starving = plan(BASE, &DARK);
    assert!(problems(starving).contains("does not make `show.screen`"), "the output starves");
}

#[test]
fn a_pass_that_is_switched_off_hands_its_input_on() {
    let text = |mode: &str| {
        format!(
            r#"(passes: {{"floor": surface(), "lamp": toy_lamp(), "filter": filter(mode: {mode}, from: {{"light": "lamp.light"}}), "show": show(from: {{"light": "filter"}})}},
               output: "show")"#
        )
    };
    let on = plan(&text("lit"), &LIT).unwrap();
    assert_eq!(names(&on), ["floor", "lamp", "filter", "show"]);
    let off = plan(&text("bypass"), &LIT).unwrap();
    assert_eq!(names(&off), ["floor", "lamp", "show"]);
    assert_eq!(off.resources[off.passes[2].inputs[0][0]].name, "lamp.light");
    assert!(off.dropped[0].forwards);
    // Whoever asks for the filter's output gets what it forwards.
    assert_eq!(off.find("filter.light"), off.find("lamp.light"));
}

#[test]
fn lists_take_every_producer_that_does_not_depend_on_them() {
    let text = r#"(
        passes: {
            "floor": surface(), "a": toy_lamp(), "b": toy_lamp(), "sum": sum(),
            "after": filter(from: {"light": "sum.light"}), "show": show(from: {"light": "after.light"}),
        },
        output: "show",
    )"#;
    let plan = plan(text, &LIT).unwrap();
    let sum = plan.passes.iter().find(|pass| pass.name == "sum").unwrap();
    let terms: Vec<_> = sum.inputs[0].iter().map(|index| plan.resources[*index].name.as_str()).collect();
    assert_eq!(terms, ["a.light", "b.light"]);
}

#[test]
fn textures_share_memory_when_their_lifetimes_do_not_overlap() {
    let chain = r#"(
        passes: {
            "floor": surface(), "lamp": toy_lamp(), "f1": filter(from: {"light": "lamp"}), "f2": filter(from: {"light": "f1"}),
            "f3": filter(from: {"light": "f2"}), "show": show(from: {"light": "f3"}),
        },
        output: "show",
    )"#;
    let plan = plan(chain, &LIT).unwrap();
    let image = 8 * 4 * 8;
    assert_eq!(plan.bytes_without_reuse(), 6 * image);
    // A pass reads one and writes another, so a chain needs two; the output is one of them.
    assert_eq!(plan.bytes(), 2 * image);
    for (index, slot) in plan.slots.iter().enumerate() {
        for pair in slot.users.windows(2) {
            let (first, second) = (&plan.resources[pair[0].0], &plan.resources[pair[1].0]);
            assert!(first.last_use < second.maker, "slot {index}: {} and {} overlap", first.name, second.name);
        }
    }
    let separate = wire(chain, &[], &[]).unwrap().plan(&LIT, &PlanOptions { reuse: false, ..PlanOptions::new([8, 4]) }).unwrap();
    assert_eq!(separate.bytes(), 6 * image);
}

#[test]
fn kept_resources_are_not_overwritten() {
    let chain = r#"(
        passes: {"floor": surface(), "lamp": toy_lamp(), "f1": filter(from: {"light": "lamp"}), "f2": filter(from: {"light": "f1"}), "show": show(from: {"light": "f2"})},
        output: "show",
    )"#;
    let wired = wire(chain, &[], &[]).unwrap();
    let plan = wired.plan(&LIT, &PlanOptions { keep: vec!["lamp.light".into()], ..PlanOptions::new([8, 4]) }).unwrap();
    let lamp = &plan.resources[plan.find("lamp.light").unwrap()];
    assert!(lamp.kept);
    assert_eq!(plan.slots[lamp.slots[0]].users.last().unwrap().1, "image");
    assert_eq!(plan.resources[plan.slots[lamp.slots[0]].users.last().unwrap().0].name, "lamp.light");
}

#[test]
fn history_makes_no_cycle_doubles_its_resource_and_never_shares() {
    let text = r#"(
        passes: {"floor": surface(), "lamp": toy_lamp(), "blend": blend(from: {"light": "lamp", "previous": "blend.light"}), "show": show(from: {"light": "blend"})},
        output: "show",
    )"#;
    let plan = plan(text, &LIT).unwrap();
    assert_eq!(names(&plan), ["floor", "lamp", "blend", "show"]);
    let blended = &plan.resources[plan.find("blend.light").unwrap()];
    assert!(blended.history);
    assert_eq!(blended.slots.len(), 2);
    assert!(blended.slots.iter().all(|slot| plan.slots[*slot].users.len() == 1));
    assert_eq!(plan.passes[2].inputs[1], [plan.find("blend.light").unwrap()]);
}

#[test]
fn specialising_sets_flags_and_can_be_switched_off() {
    let wired = wire(BASE, &[], &[]).unwrap();
    let special = wired.plan(&DIFFUSE, &PlanOptions::new([8, 4])).unwrap();
    assert!(!special.passes[0].specialisations[0].on);
    let general = wired.plan(&DIFFUSE, &PlanOptions { specialise: false, ..PlanOptions::new([8, 4]) }).unwrap();
    assert!(general.passes[0].specialisations[0].on);
    assert_ne!(special.fingerprint(), general.fingerprint());
}

#[test]
fn fingerprints_tell_plans_apart() {
    let of = |variants: &[&str], sets: &[&str], extent| {
        wire(BASE, variants, sets).unwrap().plan(&LIT, &PlanOptions::new(extent)).unwrap().fingerprint()
    };
    let base = of(&[], &[], [8, 4]);
    assert_eq!(base, of(&[], &[], [8, 4]));
    assert_eq!(base, of(&[], &["lamp.count=8"], [8, 4]));
    for other in [of(&["open"], &[], [8, 4]), of(&[], &["lamp.count=9"], [8, 4]), of(&[], &[], [4, 8])] {
        assert_ne!(base, other);
    }
}

#[test]
fn shape_errors_name_the_pass_and_the_place() {
    let text = problems(wire(BASE, &["many"], &[]).unwrap().plan(&LIT, &PlanOptions::new([8, 4])));
    assert!(text.contains("pass `lamp` (toy-lamp): more than 32 lamps do not fit"), "{text}");
    assert!(text.starts_with("test.ron:12:"), "{text}");
}

#[test]
fn a_picture_claims_what_the_passes_behind_it_claim() {
    let text = |mode: &str| {
        format!(
            r#"(passes: {{
                "floor": surface(), "shadow": shadow(),
                "a": toy_lamp(count: 1), "b": toy_lamp(count: 2, mode: {mode}), "c": toy_lamp(count: 3),
                "sum": sum(from: {{"terms": ["a.light", "b.light"]}}), "blend": blend(from: {{"light": "sum.light", "previous": "c.light"}}),
                "aside": filter(from: {{"light": "c.light"}}), "show": show(from: {{"light": "blend.light"}}),
            }}, output: "show")"#
        )
    };
    let options =
        PlanOptions { keep: ["sum.light", "aside.light", "floor.surface"].map(str::to_owned).to_vec(), ..PlanOptions::new([8, 4]) };
    let claims = |mode: &str| {
        let plan = wire(&text(mode), &[], &[]).unwrap().plan(&LIT, &options).unwrap();
        ["a.light", "sum.light", "aside.light", "show.screen", "floor.surface"].map(|name| plan.find(name).map(|at| plan.claim(at)))
    };
    // What is summed joins, what last frame's was made from counts, what only filters or displays adds nothing, and what is beside the way does not count.
    assert_eq!(claims("lit"), [Some(0b0010), Some(0b0110), Some(0b1000), Some(0b1110), Some(0)]);
    // What this scene drops, or what is switched off, claims nothing.
    assert_eq!(claims("absent")[1..4], [Some(0b0010), Some(0b1000), Some(0b1010)]);
}

#[test]
fn passes_behind_a_picture_are_found_once_and_in_order() {
    let plan = plan(BASE, &LIT).unwrap();
    let behind = |name: &str| -> Vec<String> {
        plan.behind(plan.find(name).unwrap()).into_iter().map(|pass| plan.passes[pass].name.clone()).collect()
    };
    assert_eq!(behind("show.screen"), ["floor", "shadow", "lamp", "show"]);
    assert_eq!(behind("lamp.light"), ["floor", "shadow", "lamp"]);
    assert_eq!(plan.passes.iter().map(|pass| pass.claim).collect::<Vec<_>>(), [None, None, None, None], "a count of 8 has no bit");
}
