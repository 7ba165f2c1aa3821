//! `rig live`: a log as it grows, on the terminal and over the network.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use interstage::supervise::Command;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

use super::failure::{Failure, Outcome};
use super::log_files::{LogFiles, Stop};
use super::output;
use super::source::SourceArgs;
use crate::live::{Known, Screen, Server};
use crate::record::{Decoder, Item, Source, messages};
use crate::scenario::Scenario;

/// Time between two frames of the screen.
const REDRAW: Duration = Duration::from_millis(50);

/// Shows the controller's log as it arrives: plots, contact stage, faults, and keys for
/// start, stop and retract.
///
/// The space bar stops the drive, as `x` does. Ending the view does not. The same goes out over
/// a WebSocket in the Foxglove protocol, for Foxglove, Lichtblick and PlotJuggler, with the
/// layouts in examples/layouts.
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

    /// Writes the log into this directory while it is shown, as `rig capture` does.
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,

    /// As fast as it goes instead of in real time.
    #[arg(long)]
    fast: bool,
}

/// Runs the verb.
pub(crate) fn run(args: &Args) -> Result<Outcome, Failure> {
    if !args.headless && !std::io::stdout().is_terminal() {
        return Err(Failure::input("standard output is no terminal: use --headless"));
    }
    args.source.open(!args.headless, |source, scenario| watch(args, source, scenario))
}

/// A terminal that is restored however the view ends.
struct Display(ratatui::DefaultTerminal);

impl Drop for Display {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// Shows what `source` gives until it ends or the operator quits.
pub fn watch(
    args: &Args,
    source: &mut dyn Source,
    scenario: &Scenario,
) -> Result<Outcome, Failure> {
    let server = Server::bind(&args.listen)
        .map_err(|error| Failure::input(format!("--listen {}: {error}", args.listen)))?;
    let mut places = format!("ws://{}", server.address());
    let folder = args.record.as_deref();
    let files = folder.map(|folder| LogFiles::new(folder, None, false, scenario));
    let (mut files, mut decoder) = (files.transpose()?, Decoder::new());
    if let Some(files) = &files {
        places += &format!("   recorded to {}", files.mcap().display());
    }
    if args.headless {
        eprintln!("listening at {places}");
    }
    // In a terminal's raw mode Ctrl-C is a key.
    let stop = args.headless.then(Stop::by_ctrl_c);
    let display = (!args.headless).then(|| ratatui::try_init().map(Display));
    let mut display = display.transpose().map_err(Failure::run)?;
    let mut screen = Screen::new(Known::of(&scenario.rig).map_err(Failure::input)?, places);
    let mut clock = Clock::new(args.fast);
    let mut drawn = Instant::now();
    while let Some(bytes) = source.read().map_err(Failure::run)? {
        if let Some(files) = &mut files {
            files.take(&bytes, &mut |_| {})?;
        }
        decoder.read(&bytes, &mut |item| {
            screen.see(&item);
            if let Item::Tick(record, _) = &item {
                clock.tick(record.at());
            }
            if let Some((topic, body)) = messages(&item) {
                server.publish(topic, u64::from(clock.tick) * 1_000_000, body);
            }
        });
        for line in source.news().into_iter().chain(files.iter_mut().flat_map(LogFiles::news)) {
            screen.note(line);
        }
        screen.count(decoder.counts());
        clock.wait();
        if stop.as_ref().is_some_and(Stop::is_wanted) {
            break;
        }
        if drawn.elapsed() < REDRAW {
            continue;
        }
        drawn = Instant::now();
        if let Some(Display(terminal)) = &mut display {
            let drawn = terminal.draw(|frame| screen.draw(frame, decoder.counts()));
            drawn.map_err(Failure::run)?;
            let letters = keys()?;
            for letter in letters.iter().filter(|letter| **letter != QUIT) {
                source.send(*letter).map_err(Failure::run)?;
            }
            if letters.contains(&QUIT) {
                break;
            }
        }
    }
    drop(display);
    if let Some(files) = files {
        output::print(&output::wrote(&files.finish(&mut |_| {})?.1))?;
    }
    decoder.finish(&mut |_| {});
    Ok(Outcome::of(decoder.counts().is_complete()))
}

/// Key that ends the view; Escape and Ctrl-C do too.
const QUIT: u8 = b'q';

/// The letters of all keys that were pressed since the last call.
fn keys() -> Result<Vec<u8>, Failure> {
    let mut letters = Vec::new();
    while event::poll(Duration::ZERO).map_err(Failure::run)? {
        letters.extend(letter(&event::read().map_err(Failure::run)?));
    }
    Ok(letters)
}

/// The letter of a key that has a meaning.
fn letter(event: &Event) -> Option<u8> {
    let Event::Key(key) = event else { return None };
    if key.kind != KeyEventKind::Press {
        return None;
    }
    match key.code {
        KeyCode::Esc => Some(QUIT),
        // In raw mode the terminal does not end the program.
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(QUIT),
        KeyCode::Char(' ') => Some(crate::record::letter(Command::Stop)),
        KeyCode::Char(letter @ ('q' | 's' | 'x' | 'r' | '0')) => Some(letter as u8),
        _ => None,
    }
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

    /// Waits for the log's time to have passed.
    fn wait(&self) {
        let Some(first) = self.first.filter(|_| !self.fast) else { return };
        let passed = Duration::from_millis(u64::from(self.tick.wrapping_sub(first)));
        std::thread::sleep(passed.saturating_sub(self.began.elapsed()).min(REDRAW));
    }
}

#[cfg(test)]
mod tests {
    use ratatui::crossterm::event::KeyEvent;

    use super::*;

    #[test]
    fn the_space_bar_and_x_stop_and_what_ends_the_view_sends_nothing() {
        let of = |code, modifiers| letter(&Event::Key(KeyEvent::new(code, modifiers)));
        let plain = |letter| of(KeyCode::Char(letter), KeyModifiers::NONE);
        let stop = Some(crate::record::letter(Command::Stop));
        assert_eq!((plain(' '), plain('x')), (stop, stop));
        let command = |command| Some(crate::record::letter(command));
        assert_eq!(
            (plain('s'), plain('r'), plain('0')),
            (command(Command::Start), command(Command::Retract), command(Command::Reset))
        );
        let ends = [of(KeyCode::Esc, KeyModifiers::NONE), plain('q')];
        assert_eq!(ends, [Some(QUIT); 2]);
        assert_eq!(of(KeyCode::Char('c'), KeyModifiers::CONTROL), Some(QUIT));
        assert_eq!((plain('c'), of(KeyCode::Enter, KeyModifiers::NONE)), (None, None));
    }
}
