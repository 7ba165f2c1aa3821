//! A port that reconnects after its cable was unplugged.

use std::time::{Duration, Instant};

use super::{Port, PortError};

/// How a port is opened.
type Connect<'a> = Box<dyn FnMut() -> Result<Box<dyn Port + 'a>, PortError> + 'a>;

/// A port that is opened again when it fails, until its timeout has passed. What the board
/// sends meanwhile is lost; the sequence numbers of the log show how much.
pub struct ReconnectingPort<'a> {
    connect: Connect<'a>,
    port: Option<Box<dyn Port + 'a>>,
    /// Time between two attempts.
    pause: Duration,
    /// Longest time without the board.
    timeout: Duration,
    /// When it was lost, and when it was last tried.
    lost: Option<(Instant, Instant)>,
    opened: Instant,
    news: Vec<String>,
}

impl<'a> ReconnectingPort<'a> {
    /// Opens the port by `connect`, and again at most every `pause` when it fails.
    pub fn open(
        mut connect: impl FnMut() -> Result<Box<dyn Port + 'a>, PortError> + 'a,
        pause: Duration,
        timeout: Duration,
    ) -> Result<Self, PortError> {
        let port = connect()?;
        Ok(Self {
            connect: Box::new(connect),
            port: Some(port),
            pause,
            timeout,
            lost: None,
            opened: Instant::now(),
            news: Vec::new(),
        })
    }

    /// Events of the port since the last call, a line each.
    pub(crate) fn take_news(&mut self) -> Vec<String> {
        std::mem::take(&mut self.news)
    }

    /// Tries once; returns `otherwise` while the board is disconnected.
    fn attempt<T>(
        &mut self,
        otherwise: T,
        act: impl FnOnce(&mut dyn Port) -> Result<T, PortError>,
    ) -> Result<T, PortError> {
        self.reopen()?;
        let Some(port) = &mut self.port else { return Ok(otherwise) };
        match act(port.as_mut()) {
            Err(PortError::Gone(why)) => {
                let now = Instant::now();
                self.port = None;
                self.lost = Some((now, now));
                self.news.push(format!("the debug probe is gone ({why}); waiting for it"));
                Ok(otherwise)
            }
            other => other,
        }
    }

    /// Opens the port again if it is lost and the pause is over.
    fn reopen(&mut self) -> Result<(), PortError> {
        let Some((since, tried)) = self.lost else { return Ok(()) };
        if tried.elapsed() < self.pause {
            return Ok(());
        }
        match (self.connect)() {
            Ok(port) => {
                self.port = Some(port);
                self.lost = None;
                let away = since.elapsed().as_secs_f64();
                self.news.push(format!("the debug probe is back after {away:.1} s"));
                Ok(())
            }
            Err(PortError::Board(why)) => Err(PortError::Board(why)),
            Err(error) if since.elapsed() >= self.timeout => {
                let timeout = self.timeout.as_secs_f64();
                Err(PortError::Gone(format!("not back within {timeout:.0} s: {error}")))
            }
            Err(_) => {
                self.lost = Some((since, Instant::now()));
                Ok(())
            }
        }
    }
}

impl Port for ReconnectingPort<'_> {
    fn up(&mut self, channel: u32) -> Result<Vec<u8>, PortError> {
        self.attempt(Vec::new(), |port| port.up(channel))
    }

    fn down(&mut self, channel: u32, bytes: &[u8]) -> Result<usize, PortError> {
        self.attempt(0, |port| port.down(channel, bytes))
    }

    fn reset(&mut self) -> Result<(), PortError> {
        self.attempt((), |port| port.reset())
    }

    fn memory(&mut self, address: u32, into: &mut [u8]) -> Result<(), PortError> {
        self.reopen()?;
        match &mut self.port {
            Some(port) => port.memory(address, into),
            None => Err(PortError::Gone("unplugged".to_owned())),
        }
    }

    fn pass(&mut self) -> Result<(), PortError> {
        if !self.attempt(false, |port| port.pass().map(|()| true))? {
            std::thread::sleep(self.pause.min(Duration::from_millis(5)));
        }
        Ok(())
    }

    fn now(&self) -> Duration {
        self.opened.elapsed()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::cell::RefCell;
    use std::collections::VecDeque;
    use std::rc::Rc;

    use super::*;

    /// Results of the next calls, of the port or of opening it.
    #[derive(Clone)]
    pub(crate) enum Next {
        Bytes(Vec<u8>),
        Unplugged,
        NotThere,
        Opens,
        Wrong,
    }

    impl Next {
        pub(crate) fn bytes(bytes: &[u8]) -> Self {
            Self::Bytes(bytes.to_vec())
        }
    }

    type Script = Rc<RefCell<VecDeque<Next>>>;

    struct Fake(Script);

    impl Fake {
        fn next(&self) -> Result<Vec<u8>, PortError> {
            match self.0.borrow_mut().pop_front() {
                Some(Next::Bytes(bytes)) => Ok(bytes),
                Some(Next::Unplugged) => Err(PortError::Gone("USB error".to_owned())),
                Some(Next::Wrong) => Err(PortError::Board("no channel".to_owned())),
                _ => panic!("the port was not opened again"),
            }
        }
    }

    impl Port for Fake {
        fn up(&mut self, _: u32) -> Result<Vec<u8>, PortError> {
            self.next()
        }

        fn down(&mut self, _: u32, _: &[u8]) -> Result<usize, PortError> {
            self.next().map(|bytes| bytes.len())
        }

        fn reset(&mut self) -> Result<(), PortError> {
            panic!("a board that runs is not reset");
        }

        fn memory(&mut self, _: u32, _: &mut [u8]) -> Result<(), PortError> {
            panic!("memory is not read");
        }

        fn pass(&mut self) -> Result<(), PortError> {
            Ok(())
        }

        fn now(&self) -> Duration {
            Duration::ZERO
        }
    }

    pub(crate) fn open(
        script: impl IntoIterator<Item = Next>,
        timeout: Duration,
    ) -> (ReconnectingPort<'static>, Script) {
        let script: Script = Rc::new(RefCell::new(script.into_iter().collect()));
        let inside = Rc::clone(&script);
        let connect = move || -> Result<Box<dyn Port>, PortError> {
            match inside.borrow_mut().pop_front() {
                Some(Next::Opens) => Ok(Box::new(Fake(Rc::clone(&inside)))),
                Some(Next::NotThere) | None => Err(PortError::Absent("no probe".to_owned())),
                _ => panic!("opened without need"),
            }
        };
        (ReconnectingPort::open(connect, Duration::ZERO, timeout).unwrap(), script)
    }

    #[test]
    fn it_gives_up_after_the_timeout() {
        let (mut port, _) = open([Next::Opens, Next::Unplugged], Duration::ZERO);
        assert_eq!(port.up(1), Ok(Vec::new()));
        let error = port.up(1).unwrap_err().to_string();
        assert!(error.contains("not back") && error.contains("no probe"), "{error}");
    }

    #[test]
    fn a_board_that_is_another_one_is_an_error_at_once() {
        let (mut port, _) = open([Next::Opens, Next::Wrong], Duration::from_secs(60));
        assert_eq!(port.up(1), Err(PortError::Board("no channel".to_owned())));
    }

    #[test]
    fn a_port_that_cannot_be_opened_is_an_error_at_once() {
        let connect = || Err(PortError::Absent("no probe".to_owned()));
        let opened = ReconnectingPort::open(connect, Duration::ZERO, Duration::from_secs(60));
        assert_eq!(opened.err(), Some(PortError::Absent("no probe".to_owned())));
    }
}
