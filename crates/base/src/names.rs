//! Nearest names, for messages that say "did you mean".

use std::cmp::Reverse;

/// The candidate that a reader who wrote `name` most likely meant; `None` if none is close. Case does not matter, and `_` and `-` are the same.
///
/// A candidate is close if it has the same letters, if few differ (one, or up to a third of those of the longer name; two swapped neighbours count
/// once), or if it has a Jaro-Winkler likeness (Winkler 1990) above 0.75, which also finds names of which only the beginning was written. Among close ones, one of the same
/// letters in another order wins, then the one with the fewest edits, then the most alike, then the first.
pub fn nearest<'a>(name: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase().replace('_', "-");
    let sorted = |text: &str| {
        let mut letters: Vec<char> = text.chars().collect();
        letters.sort_unstable();
        letters
    };
    let written = plain(name);
    let letters = sorted(&written);
    let rank = |candidate: &'a str| {
        let meant = plain(candidate);
        let edits = strsim::osa_distance(&written, &meant);
        let likeness = strsim::jaro_winkler(&written, &meant);
        let longest = written.chars().count().max(meant.chars().count());
        let same = sorted(&meant) == letters;
        let close = same || edits <= (longest / 3).max(1) && edits < longest || likeness > 0.75;
        // What only begins alike is a second choice, however short: edits count there by the letters that were written and do not fit.
        let misfits = if meant.starts_with(&written) { 1 } else { edits };
        close.then_some((Reverse((!same, misfits)), likeness, candidate))
    };
    // The last of equals is taken, so the list is walked from its end.
    let found: Vec<_> = candidates.into_iter().filter_map(rank).collect();
    let best = found.into_iter().rev().max_by(|left, right| left.0.cmp(&right.0).then(left.1.total_cmp(&right.1)));
    best.map(|(.., candidate)| candidate)
}

#[cfg(test)]
mod tests {
    use super::nearest;
    use proptest::prelude::*;

    const VARIANTS: [&str; 16] = [
        "vpl",
        "vsl",
        "vsgl",
        "vsgl-accurate",
        "vsgl-consistent",
        "vsgl-steady",
        "two-vsgl",
        "interleaved",
        "flux-density",
        "bidirectional",
        "exact-visibility",
        "imperfect-visibility",
        "uniform-imperfect-visibility",
        "no-visibility",
        "half",
        "full",
    ];

    #[test]
    fn equal_letters_win() {
        for (written, meant) in [
            ("vgsl", "vsgl"),
            ("vlp", "vpl"),
            ("lvs", "vsl"),
            ("vsg", "vsl"),
            ("vsgll", "vsgl"),
            ("VSGL", "vsgl"),
            ("hafl", "half"),
            ("ful", "full"),
            ("no_visibilty", "no-visibility"),
            ("exact", "exact-visibility"),
            ("inperfect-visibility", "imperfect-visibility"),
            ("interleave", "interleaved"),
            ("vsgl-acurate", "vsgl-accurate"),
        ] {
            let found = nearest(written, VARIANTS);
            // `vsg` is one edit from `vsl` and from `vsgl`, and begins the latter.
            let expected = if written == "vsg" { "vsgl" } else { meant };
            assert_eq!(found, Some(expected), "{written}");
        }
    }

    #[test]
    fn what_is_not_close_is_not_named() {
        for written in ["", "x", "photon-map", "zzzz", "qq"] {
            assert_eq!(nearest(written, VARIANTS), None, "{written}");
        }
        assert_eq!(nearest("a", []), None);
        assert_eq!(nearest("a", ["b"]), None);
    }

    proptest! {
        /// Two swapped neighbours in a name of a list always lead back to a name of the same letters.
        #[test]
        fn a_swap_is_undone(index in 0..VARIANTS.len(), at in 0_usize..32) {
            let mut letters: Vec<char> = VARIANTS[index].chars().collect();
            let at = at % (letters.len() - 1);
            letters.swap(at, at + 1);
            let written: String = letters.into_iter().collect();
            prop_assert_eq!(nearest(&written, VARIANTS), Some(VARIANTS[index]));
        }
    }
}
