//! A board at a debug probe, as it runs.

use std::collections::VecDeque;

use super::{Source, SourceError};
use crate::probe::{Port, ReconnectingPort};

/// RTT channel of the binary log, up.
const LOG: u32 = 1;
/// RTT channel of the console, down.
const CONSOLE: u32 = 0;
/// Polls of the channel in each reading, so that the display gets its turn.
const LOOKS: u32 = 20;

/// The log of a board at a probe. It is not reset and gets no command but the
/// operator's.
///
/// The probe may be unplugged and the board may restart: what was not read is missing, and
/// marked where it is missing by the log's own numbers. It ends when the port gives up.
pub struct Probed<'a> {
    port: ReconnectingPort<'a>,
    letters: VecDeque<u8>,
}

impl<'a> Probed<'a> {
    /// Over this port.
    #[must_use]
    pub const fn new(port: ReconnectingPort<'a>) -> Self {
        Self { port, letters: VecDeque::new() }
    }
}

impl Source for Probed<'_> {
    fn read(&mut self) -> Result<Option<Vec<u8>>, SourceError> {
        let mut come = Vec::new();
        for _ in 0..LOOKS {
            if let Some(letter) = self.letters.front()
                && self.port.down(CONSOLE, &[*letter])? == 1
            {
                self.letters.pop_front();
            }
            come.extend(self.port.up(LOG)?);
            self.port.pass()?;
        }
        Ok(Some(come))
    }

    fn send(&mut self, letter: u8) -> Result<(), SourceError> {
        self.letters.push_back(letter);
        Ok(())
    }

    fn news(&mut self) -> Vec<String> {
        self.port.take_news()
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;
    use std::time::Duration;

    use super::*;
    use crate::probe::PortError;
    use crate::record::{Mark, Run, Virtual, Writer};
    use crate::replay::replay;
    use crate::scenario::Scenario;
    use interstage::rig::Rig;

    /// What a board has sent, look by look, and what happens to its cable.
    enum Look {
        Bytes(Vec<u8>),
        Error,
    }

    struct Cable {
        looks: VecDeque<Look>,
        letters: Vec<u8>,
        opened: u32,
    }

    struct Plug(Rc<RefCell<Cable>>);

    impl Port for Plug {
        fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
            assert_eq!(channel, LOG);
            let mut cable = self.0.borrow_mut();
            match cable.looks.pop_front() {
                Some(Look::Bytes(bytes)) => Ok(bytes),
                Some(Look::Error) => Err(PortError::Gone("USB error".to_owned())),
                None => Err(PortError::Board("the script is over".to_owned())),
            }
        }

        fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
            assert_eq!(channel, CONSOLE);
            self.0.borrow_mut().letters.extend(bytes);
            Ok(bytes.len())
        }

        fn reset(&mut self) -> Result<(), PortError> {
            panic!("a board that runs is left alone");
        }

        fn memory(&mut self, _: u32, _: &mut [u8]) -> Result<(), PortError> {
            panic!("a board that runs is left alone");
        }

        fn pass(&mut self) -> Result<Duration, PortError> {
            Ok(Duration::ZERO)
        }
    }

    /// The frames of a run in software, as a board would send them.
    fn sent() -> Vec<u8> {
        let mut source = Virtual::new(&Scenario::default(), false).unwrap();
        let mut bytes = Vec::new();
        while let Some(part) = source.read().unwrap() {
            bytes.extend(part);
        }
        bytes
    }

    /// Captures what comes over the cable until its script is over.
    fn captured(looks: Vec<Look>) -> (Run, Vec<String>, u32) {
        let cable = Cable { looks: looks.into(), letters: Vec::new(), opened: 0 };
        let cable = Rc::new(RefCell::new(cable));
        let inside = Rc::clone(&cable);
        let connect = move || -> Result<Box<dyn Port>, PortError> {
            let mut cable = inside.borrow_mut();
            cable.opened += 1;
            // The first attempt after it was lost finds nothing yet.
            if cable.opened.is_multiple_of(2) {
                return Err(PortError::Absent("no probe".to_owned()));
            }
            Ok(Box::new(Plug(Rc::clone(&inside))))
        };
        let port =
            ReconnectingPort::open(connect, Duration::ZERO, Duration::from_secs(60)).unwrap();
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
        news.extend(source.news());
        writer.finish(&mut |_| {}).unwrap();
        assert_eq!(cable.borrow().letters, b"s");
        let opened = cable.borrow().opened;
        (Run::read(&path).unwrap(), news, opened)
    }

    fn in_looks(bytes: &[u8]) -> impl Iterator<Item = Look> {
        bytes.chunks(997).map(|part| Look::Bytes(part.to_vec()))
    }

    /// Nothing, for so long that what came before has been handed on.
    fn quiet() -> impl Iterator<Item = Look> {
        (0..2 * LOOKS).map(|_| Look::Bytes(Vec::new()))
    }

    #[test]
    fn a_cable_that_is_pulled_leaves_a_marked_gap_and_the_rest_whole() {
        let bytes = sent();
        let whole = Run::of_stream(&bytes);
        // A third of the way in, at no particular byte, 20 kB are lost.
        let (from, lost) = (bytes.len() / 3, 20_000);
        let (before, after) = (in_looks(&bytes[..from]), in_looks(&bytes[from + lost..]));
        let looks = before.chain([Look::Error]).chain(after).chain(quiet()).collect();
        let (run, news, opened) = captured(looks);
        assert_eq!(opened, 3, "opened, not there, opened again");
        assert_eq!(news.len(), 2, "{news:?}");
        // Two halves of frames meet where the cable was out, and the rest is counted.
        let lost = run.marks.iter().find_map(|(_, mark)| match mark {
            Mark::Lost { frames, dropped: 0 } => Some(u64::from(*frames)),
            _ => None,
        });
        assert_eq!(lost, Some(run.counts.lost_frames));
        assert_eq!(run.counts.frames + run.counts.lost_frames, whole.counts.frames);
        let missing = whole.rows.len() - run.rows.len();
        assert!(missing > 300, "{missing}");
        assert_eq!(run.counts.lost_ticks, missing as u64);
        assert!(replay(&run, &Rig::prototype()).unwrap().difference.is_none());
    }

    #[test]
    fn a_restart_in_the_middle_is_marked_and_both_parts_are_there() {
        let bytes = sent();
        let whole = Run::of_stream(&bytes);
        let looks = in_looks(&bytes[..bytes.len() / 2]).chain([Look::Error]);
        let (run, _, _) = captured(looks.chain(in_looks(&bytes)).chain(quiet()).collect());
        assert_eq!(run.counts.restarts, 1, "{:?}", run.marks);
        let again = run.rows.iter().rposition(|row| row.tick == 0).unwrap();
        assert_eq!(run.rows.len() - again, whole.rows.len());
        assert!(again > whole.rows.len() / 3);
        assert!(replay(&run, &Rig::prototype()).unwrap().difference.is_none());
    }
}
