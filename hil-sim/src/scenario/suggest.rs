//! The known key nearest to a mistyped one.

/// A half-sentence that points at the known key nearest to `key`, or at the list.
pub(super) fn hint(key: &str, known: &[String]) -> String {
    match nearest(key, known) {
        Some(found) => format!(", did you mean {found}?"),
        None => "; `rig keys` lists them".to_owned(),
    }
}

/// The known key nearest to `key`, if any is near.
fn nearest<'a>(key: &str, known: &'a [String]) -> Option<&'a str> {
    known
        .iter()
        .map(|candidate| (distance(key, candidate), candidate.as_str()))
        .min()
        .filter(|&(distance, _)| distance <= 2 + key.len() / 6)
        .map(|(_, candidate)| candidate)
}

/// Edits from `key` to `candidate`. The wrong section costs one edit, a forgotten
/// unit or a wrong one as well.
fn distance(key: &str, candidate: &str) -> usize {
    let edits = strsim::damerau_levenshtein(key, candidate);
    let (_, found) = split(key);
    let (_, wanted) = split(candidate);
    if wanted.is_empty() || found.is_empty() {
        return edits;
    }
    let leaf = 1 + strsim::damerau_levenshtein(found, wanted);
    let same_stem = wanted.strip_prefix(found).is_some_and(|rest| rest.starts_with('_'))
        || super::keys::stem(found) == super::keys::stem(wanted);
    let stem = if same_stem { 1 + usize::from(split(key).0 != split(candidate).0) } else { edits };
    edits.min(leaf).min(stem)
}

/// Section and name; a key without a dot is a name without section.
fn split(key: &str) -> (&str, &str) {
    key.rsplit_once('.').unwrap_or(("", key))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known() -> Vec<String> {
        crate::scenario::Scenario::default().keys().into_iter().map(|k| k.key).collect()
    }

    #[test]
    fn finds_typing_errors_wrong_sections_and_forgotten_units() {
        let known = known();
        for (key, wanted) in [
            ("tread.tau", "tread.tau_s"),
            ("tread.tau_ms", "tread.tau_s"),
            ("tau_s", "tread.tau_s"),
            ("tread.stifening", "tread.stiffening"),
            ("rig.mu", "plant.mu"),
            ("prelaod.limit_n", "preload.limit_n"),
            ("rig.step_height", "rig.step_height_mm"),
            ("seed", "run.seed"),
            ("drive.cruise_speed_m_s", "drive.cruise_speed_mm_s"),
        ] {
            assert_eq!(nearest(key, &known), Some(wanted), "{key}");
        }
    }

    #[test]
    fn does_not_guess_when_nothing_is_near() {
        assert_eq!(nearest("colour.of_the_sleeve", &known()), None);
    }
}
