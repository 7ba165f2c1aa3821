//! The log of a running board at a debug probe.

use std::collections::VecDeque;

use interstage::supervise::Command;

use super::{Source, SourceError, letter};
use crate::probe::{CONSOLE, LOG, Port, ReconnectingPort};

/// Polls of the channel per call, so that the display is updated in between.
const POLLS: u32 = 20;
const STOP: u8 = letter(Command::Stop);

/// The log of a board at a probe. The board is not reset and gets only the operator's
/// commands.
///
/// The probe may be unplugged and the board may restart. The sequence numbers of the log show
/// what was not read. The log ends when the port gives up. A command that cannot be sent at once is
/// dropped, unless it is a stop.
pub struct Probed<'a> {
    port: ReconnectingPort<'a>,
    letters: VecDeque<u8>,
    news: Vec<String>,
}

impl<'a> Probed<'a> {
    pub const fn new(port: ReconnectingPort<'a>) -> Self {
        Self { port, letters: VecDeque::new(), news: Vec::new() }
    }

    /// Drops what could not be sent, not to be sent later: the operator has to see the board as
    /// it is then. A stop stays.
    fn drop_unsent(&mut self) {
        self.letters.retain(|letter| {
            if *letter != STOP {
                let key = char::from(*letter);
                self.news.push(format!("`{key}` was not sent: the board has restarted or is gone"));
            }
            *letter == STOP
        });
    }
}

impl Source for Probed<'_> {
    fn read(&mut self) -> Result<Option<Vec<u8>>, SourceError> {
        let mut read = Vec::new();
        for _ in 0..POLLS {
            if let Some(letter) = self.letters.front() {
                if self.port.down(CONSOLE, &[*letter])? == 1 {
                    self.letters.pop_front();
                } else {
                    self.drop_unsent();
                }
            }
            read.extend(self.port.up(LOG)?);
            self.port.pass()?;
        }
        Ok(Some(read))
    }

    fn send(&mut self, letter: u8) -> Result<(), SourceError> {
        // A stop waits for no other command.
        if letter == STOP {
            self.letters.clear();
        }
        self.letters.push_back(letter);
        Ok(())
    }

    fn news(&mut self) -> Vec<String> {
        let mut news = self.port.take_news();
        news.append(&mut self.news);
        news
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::probe::script::{Next, open};
    use crate::record::decoder::tests::deployment;
    use crate::record::{Mark, Run, Writer};
    use crate::replay::replay;
    use interstage::rig::Rig;

    /// Sends a letter, then captures what the polls of the channel return; empty polls after
    /// them pass the rest on.
    fn captured(polls: impl Iterator<Item = Next>) -> (Run, Vec<String>) {
        let letter = [Next::Opens, Next::bytes(b"s")].into_iter();
        let quiet = (0..2 * POLLS).map(|_| Next::bytes(b""));
        let script = letter.chain(polls).chain(quiet).chain([Next::Wrong]);
        let (port, left) = open(script, Duration::from_secs(60));
        let mut source = Probed::new(port);
        source.send(b's').unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.mcap");
        let file = std::fs::File::create(&path).unwrap();
        let mut writer = Writer::new(Some(file), None::<Vec<u8>>, None, false).unwrap();
        let mut news = Vec::new();
        while let Ok(Some(bytes)) = source.read() {
            writer.take(&bytes, &mut |_| {}).unwrap();
            news.extend(source.news());
        }
        writer.finish(&mut |_| {}).unwrap();
        assert!(left.borrow().is_empty());
        (Run::read(&path).unwrap(), news)
    }

    fn in_polls(bytes: &[u8]) -> impl Iterator<Item = Next> {
        bytes.chunks(997).map(Next::bytes)
    }

    /// The cable is pulled; the first attempt to open the port again fails.
    fn pulled() -> [Next; 3] {
        [Next::Unplugged, Next::NotThere, Next::Opens]
    }

    #[test]
    fn a_cable_that_is_pulled_leaves_a_marked_gap_and_the_rest_intact() {
        let bytes = deployment().stream;
        let all = Run::of_stream(&bytes);
        // At a third of the log, at an arbitrary byte, 20 kB are lost.
        let (from, lost) = (bytes.len() / 3, 20_000);
        let (before, after) = (in_polls(&bytes[..from]), in_polls(&bytes[from + lost..]));
        let (run, news) = captured(before.chain(pulled()).chain(after));
        let [gone, back] = &news[..] else { panic!("{news:?}") };
        assert!(gone.contains("USB error") && back.contains("is back after"), "{news:?}");
        // Parts of two frames meet where the cable was out; the lost frames are counted.
        let lost = run.marks.iter().find_map(|(_, mark)| match mark {
            Mark::Lost { frames, dropped: 0 } => Some(u64::from(*frames)),
            _ => None,
        });
        assert_eq!(lost, Some(run.counts.lost_frames));
        assert_eq!(run.counts.frames + run.counts.lost_frames, all.counts.frames);
        let missing = all.rows.len() - run.rows.len();
        assert!(missing > 300, "{missing}");
        assert_eq!(run.counts.lost_ticks, missing as u64);
        assert!(replay(&run, &Rig::prototype()).unwrap().difference.is_none());
    }

    /// Letters that still wait after these were typed, each before one call of read.
    fn waiting(script: Vec<Next>, typed: &[&[u8]]) -> Vec<u8> {
        let (port, _) = open(script, Duration::from_secs(60));
        let mut source = Probed::new(port);
        for letters in typed {
            letters.iter().for_each(|letter| source.send(*letter).unwrap());
            source.read().unwrap();
        }
        source.letters.into()
    }

    #[test]
    fn a_start_typed_while_the_probe_is_unplugged_is_never_sent() {
        // Lost at the first poll, and away over both calls.
        let away = || std::iter::once(Next::Opens).chain([Next::Unplugged]).collect();
        assert_eq!(waiting(away(), &[b"", b"s", b""]), b"");
        // The cable is pulled as the letter is sent.
        assert_eq!(waiting(away(), &[b"s", b""]), b"");
        assert_eq!(waiting(away(), &[b"", b"x", b""]), b"x");
    }

    #[test]
    fn a_stop_goes_before_whatever_waits() {
        // The board takes nothing, or one letter.
        for (taken, left) in [(&b""[..], &b"x"[..]), (b"1", b"")] {
            let full = (0..200).map(|_| Next::bytes(b""));
            let script = [Next::Opens, Next::bytes(taken)].into_iter().chain(full);
            assert_eq!(waiting(script.collect(), &[b"srx", b""]), left);
        }
    }

    #[test]
    fn a_restart_in_the_middle_is_marked_and_both_parts_are_there() {
        let bytes = deployment().stream;
        let all = Run::of_stream(&bytes);
        let before = in_polls(&bytes[..bytes.len() / 2]);
        let (run, _) = captured(before.chain(pulled()).chain(in_polls(&bytes)));
        assert_eq!(run.counts.restarts, 1, "{:?}", run.marks);
        let again = run.rows.iter().rposition(|row| row.tick == 0).unwrap();
        assert_eq!(run.rows.len() - again, all.rows.len());
        assert!(again > all.rows.len() / 3);
        assert!(replay(&run, &Rig::prototype()).unwrap().difference.is_none());
    }
}
