use super::*;
use crate::record::Recording;
use crate::record::read::tests::read;
use crate::scenario::Scenario;
use crate::session;
use interstage::log::{LogEncoder, identity};
use interstage::tick::{Input, Output};
use proptest::prelude::*;

/// A deployment with its rows and frames.
pub(crate) fn deployment() -> Recording {
    session::run(&Scenario::default(), session::Options::ROWS).unwrap()
}

/// The frames of a target that runs for so many ticks from `from`.
pub(crate) fn frames(from: u32, ticks: u32) -> Vec<Vec<u8>> {
    let identity = Identity { schema: SCHEMA, rig: identity::text("test"), ..Default::default() };
    let (mut encoder, mut frames) = (LogEncoder::new(identity), Vec::new());
    for at in from..from + ticks {
        let mut record = Record::default();
        record.telemetry.at = at;
        record.telemetry.level = (at / 7) as u8;
        encoder.tick(&record, &mut |frame: &[u8]| {
            frames.push(frame.to_vec());
            true
        });
    }
    frames
}

/// What an encoder sends of these ticks.
fn stream(mut encoder: LogEncoder, inputs: &[Input]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut send = |frame: &[u8]| {
        bytes.extend_from_slice(frame);
        true
    };
    for input in inputs {
        let mut output = Output::default();
        output.telemetry.at = input.now;
        encoder.tick(&Record::of(input, &output), &mut send);
    }
    encoder.flush(&mut send);
    bytes
}

fn decode(bytes: &[u8], cut: usize) -> (Vec<Item>, Counts) {
    let (mut decoder, mut items) = (Decoder::new(), Vec::new());
    for part in bytes.chunks(cut.max(1)) {
        decoder.read(part, &mut |item| items.push(item));
    }
    decoder.finish(&mut |item| items.push(item));
    (items, decoder.counts)
}

fn ticks(items: &[Item]) -> Vec<u32> {
    let at = |item: &Item| if let Item::Tick(record, _) = item { Some(record.at()) } else { None };
    items.iter().filter_map(at).collect()
}

fn marks(items: &[Item]) -> Vec<Mark> {
    let mark = |item: &Item| if let Item::Mark(mark) = item { Some(*mark) } else { None };
    items.iter().filter_map(mark).collect()
}

fn bytes_of(items: &[Item]) -> Vec<u8> {
    let bytes =
        |item: &Item| if let Item::Frame(bytes) = item { bytes.clone() } else { Vec::new() };
    items.iter().flat_map(bytes).collect()
}

proptest! {
    #[test]
    fn bytes_come_in_any_pieces(cut in 1..700_usize) {
        let bytes = frames(0, 400).concat();
        let (items, counts) = decode(&bytes, cut);
        prop_assert!(ticks(&items).into_iter().eq(0..400));
        prop_assert_eq!(marks(&items), []);
        prop_assert_eq!((counts.ticks, counts.lost_frames, counts.lost_ticks), (400, 0, 0));
    }

    #[test]
    fn every_missing_frame_is_marked(gone in prop::collection::btree_set(1..49_usize, 0..30)) {
        // 50 frames of ticks and one of identity before them.
        let all = frames(0, 400);
        prop_assert_eq!(all.len(), 51);
        let kept: Vec<u8> = all
            .iter()
            .enumerate()
            .filter(|(place, _)| !gone.contains(place))
            .flat_map(|(_, frame)| frame.clone())
            .collect();
        let (items, counts) = decode(&kept, 64);
        prop_assert_eq!(counts.lost_frames, gone.len() as u64);
        let lost: u32 = marks(&items).iter().map(|mark| match mark {
            Mark::Lost { frames, .. } => *frames,
            other => panic!("{other:?}"),
        }).sum();
        prop_assert_eq!(lost as usize, gone.len());
        prop_assert_eq!(ticks(&items).len(), 400 - 8 * gone.len());
        // Those before the first tick read are unknown.
        let head = ticks(&items)[0];
        prop_assert_eq!(counts.lost_ticks as usize + head as usize, 8 * gone.len());
    }

    #[test]
    fn a_log_cut_anywhere_gives_its_complete_frames(at in 0..20_000_usize) {
        let all = frames(0, 400);
        let bytes = all.concat();
        let at = at % bytes.len();
        let (items, counts) = decode(&bytes[..at], 97);
        let mut left = at;
        let complete = all.iter().take_while(|frame| {
            let fits = frame.len() <= left;
            left = left.saturating_sub(frame.len());
            fits
        });
        prop_assert_eq!(counts.frames, complete.count() as u64);
        prop_assert!(ticks(&items).into_iter().eq(0..ticks(&items).len() as u32));
    }

    #[test]
    fn garbage_ends_at_the_next_frame(
        garbage in prop::collection::vec(any::<u8>(), 1..1500),
        at in 1..50_usize,
    ) {
        let all = frames(0, 400);
        let mut bytes = all[..at].concat();
        bytes.extend(&garbage);
        bytes.extend(all[at..].concat());
        let (items, counts) = decode(&bytes, 333);
        prop_assert!(ticks(&items).into_iter().eq(0..400));
        prop_assert_eq!(counts.garbage_bytes as usize, garbage.len());
        prop_assert_eq!(counts.lost_frames, 0);
        prop_assert_eq!(bytes_of(&items), bytes);
    }

    #[test]
    fn random_bytes_are_marked_and_no_panic(bytes in prop::collection::vec(any::<u8>(), 0..5000)) {
        let (items, counts) = decode(&bytes, 512);
        prop_assert_eq!(ticks(&items).len(), 0);
        prop_assert_eq!(counts.garbage_bytes as usize, bytes.len());
    }

    #[test]
    fn damaged_bytes_cost_their_frames_and_nothing_else(
        damages in prop::collection::vec((0..20_000_usize, 1..=255_u8), 0..12),
    ) {
        let all = frames(0, 400);
        let mut bytes = all.concat();
        let length = bytes.len();
        for (at, mask) in &damages {
            bytes[at % length] ^= mask;
        }
        let (items, _) = decode(&bytes, 100);
        let seen = ticks(&items);
        prop_assert!(seen.windows(2).all(|pair| pair[0] < pair[1]));
        prop_assert!(seen.len() + 8 * damages.len() >= 400, "{} left", seen.len());
    }

    #[test]
    fn a_restart_of_the_target_is_marked(before in 20..300_u32, after in 20..300_u32, gone in 0..3_usize) {
        let mut bytes = frames(5, before).concat();
        bytes.truncate(bytes.len() - 3);
        let second = frames(2, after);
        bytes.extend(second[gone..].concat());
        let (items, counts) = decode(&bytes, 50);
        prop_assert_eq!(counts.restarts, 1);
        let place = items.iter().position(|item| *item == Item::Mark(Mark::Restart)).unwrap();
        prop_assert!(ticks(&items[..place]).iter().all(|tick| *tick >= 5));
        let expected = after / 8 * 8 - 8 * (gone.max(1) as u32 - 1);
        prop_assert_eq!(ticks(&items[place..]).len() as u32, expected);
    }
}

#[test]
fn a_reader_that_comes_late_knows_within_a_second() {
    let all = frames(0, 3000);
    // In the middle of a frame.
    let bytes = all[60..].concat();
    let (items, counts) = decode(&bytes[100..], 100);
    assert_eq!(counts.lost_frames, 0, "frames before the first one read are not lost");
    let first = items.iter().position(|item| matches!(item, Item::Identity(_))).unwrap();
    assert!(ticks(&items[..first]).len() <= 1000);
}

#[test]
fn ticks_that_did_not_run_are_distinguished_from_those_not_logged() {
    for (overrun, expected) in
        [(true, Mark::Overrun { ticks: 3 }), (false, Mark::Skipped { ticks: 3 })]
    {
        let input = |now| Input { now, overrun: overrun && now == 15, ..Input::default() };
        let encoder = LogEncoder::new(Identity { schema: SCHEMA, ..Identity::default() });
        let bytes = stream(encoder, &[10, 11, 15].map(input));
        assert_eq!(marks(&decode(&bytes, 10).0), [expected]);
    }
}

#[test]
fn another_layout_is_refused_by_its_number_and_not_decoded_until_a_known_one_follows() {
    let inputs: [Input; 1100] =
        std::array::from_fn(|at| Input { now: at as u32, ..Input::default() });
    let of = |schema| LogEncoder::new(Identity { schema, ..Identity::default() });
    let [other, known] = [99, SCHEMA].map(|schema| stream(of(schema), &inputs));
    let (items, _) = decode(&[&other[..], &known].concat(), 10);
    let mark = Mark::Schema { found: 99 };
    assert_eq!(marks(&items), [mark, mark, Mark::Restart]);
    assert!(ticks(&items).into_iter().eq(0..1100));
    // Also from behind its first identity on.
    for from in [0, 500] {
        let why = read(&other[from..]).unwrap_err().to_string();
        assert!(why.contains("frames of schema 99") && why.lines().count() == 1, "{why}");
    }
}
