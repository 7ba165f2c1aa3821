//! `rig live`: a log as it grows, on the terminal and over the network.

use std::io::IsTerminal;
use std::time::{Duration, Instant};

use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

use super::failure::{Failure, Outcome};
use super::source::SourceArgs;
use crate::live::{Screen, Server};
use crate::record::{Decoder, Item, Source, messages};

/// Time between two frames of the screen.
const REDRAW: Duration = Duration::from_millis(50);

/// Shows the controller's log as it arrives: plots, contact stage, faults, and keys for
/// start, stop and retract.
///
/// The same goes out over a WebSocket in the Foxglove protocol, for Foxglove, Lichtblick
/// and PlotJuggler.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Where the log comes from.
    #[command(flatten)]
    pub source: SourceArgs,

    /// Where the WebSocket listens.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8765")]
    listen: String,

    /// Without the terminal: the drive starts by itself, and the run ends when it has
    /// arrived.
    #[arg(long)]
    pub headless: bool,

    /// As fast as it goes instead of in real time.
    #[arg(long)]
    fast: bool,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if !args.headless && !std::io::stdout().is_terminal() {
        return Err(Failure::input("standard output is no terminal: use --headless"));
    }
    args.source.open(!args.headless, |source, _| watch(args, source))
}

/// A terminal that is restored however the view ends.
struct Display(ratatui::DefaultTerminal);

impl Drop for Display {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// Shows what `source` gives until it ends or the operator quits.
pub fn watch(args: &Args, source: &mut dyn Source) -> Result<Outcome, Failure> {
    let server = Server::bind(&args.listen)
        .map_err(|error| Failure::input(format!("--listen {}: {error}", args.listen)))?;
    if args.headless {
        eprintln!("listening at ws://{}", server.address());
    }
    let mut display = if args.headless {
        None
    } else {
        Some(Display(ratatui::try_init().map_err(Failure::run)?))
    };
    let (mut screen, mut decoder) = (Screen::default(), Decoder::new());
    let mut clock = Clock::new(args.fast);
    let mut drawn = Instant::now();
    while let Some(bytes) = source.read().map_err(Failure::run)? {
        decoder.read(&bytes, &mut |item| {
            screen.see(&item);
            if let Item::Tick(record, _) = &item {
                clock.tick(record.at());
            }
            if let Some((topic, body)) = messages(&item) {
                server.publish(topic, clock.now_ns(), body);
            }
        });
        for line in source.news() {
            screen.note(line);
        }
        screen.count(decoder.counts());
        clock.wait();
        if drawn.elapsed() < REDRAW {
            continue;
        }
        drawn = Instant::now();
        if let Some(Display(terminal)) = &mut display {
            let drawn = terminal.draw(|frame| screen.draw(frame, decoder.counts()));
            drawn.map_err(Failure::run)?;
            match key()? {
                Some(QUIT) => break,
                Some(letter) => source.send(letter).map_err(Failure::run)?,
                None => {}
            }
        }
    }
    Ok(Outcome::of(decoder.counts().is_complete()))
}

/// Key that ends the view; Escape and Ctrl-C do too.
const QUIT: u8 = b'q';

/// The key that was pressed, if one was and has a meaning.
fn key() -> Result<Option<u8>, Failure> {
    if !event::poll(Duration::ZERO).map_err(Failure::run)? {
        return Ok(None);
    }
    let Event::Key(key) = event::read().map_err(Failure::run)? else { return Ok(None) };
    if key.kind != KeyEventKind::Press {
        return Ok(None);
    }
    Ok(match key.code {
        KeyCode::Esc => Some(QUIT),
        // In raw mode the terminal does not end the program.
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(QUIT),
        KeyCode::Char(letter @ ('q' | 's' | 'x' | 'r' | '0')) => Some(letter as u8),
        _ => None,
    })
}

/// The log's time and this host's.
struct Clock {
    fast: bool,
    began: Instant,
    first: Option<u32>,
    tick: u32,
}

impl Clock {
    fn new(fast: bool) -> Self {
        Self { fast, began: Instant::now(), first: None, tick: 0 }
    }

    /// The log has reached this tick. A restart of the target restarts the clock.
    fn tick(&mut self, tick: u32) {
        if self.first.is_none_or(|first| tick < first) {
            (self.first, self.began) = (Some(tick), Instant::now());
        }
        self.tick = tick;
    }

    /// Time since boot, ns.
    fn now_ns(&self) -> u64 {
        u64::from(self.tick) * 1_000_000
    }

    /// Waits for the log's time to have passed.
    fn wait(&self) {
        let Some(first) = self.first.filter(|_| !self.fast) else { return };
        let passed = Duration::from_millis(u64::from(self.tick.wrapping_sub(first)));
        std::thread::sleep(passed.saturating_sub(self.began.elapsed()).min(REDRAW));
    }
}
