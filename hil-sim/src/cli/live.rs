//! `rig live`: a log under way, on the terminal and on the network.

use std::fs::File;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::{self, Event, KeyCode, KeyEventKind, KeyModifiers};

use super::failure::{Failure, Outcome};
use super::scenario::RunArgs;
use crate::capture::{Bytes, Source, Virtual, messages};
use crate::export::write_text;
use crate::live::{Screen, Server, svg};
use crate::log::Decoder;
use crate::scenario::Scenario;

/// Time between two pictures of the screen.
const REDRAW: Duration = Duration::from_millis(50);
/// Size of the picture that `--picture` writes, cells.
const PICTURE: (u16, u16) = (110, 36);

/// Shows the controller's log as it comes: plots, contact stage, faults, and keys for
/// start, stop and retract.
///
/// The same goes out over a WebSocket in the Foxglove protocol, for Foxglove, Lichtblick
/// and PlotJuggler.
#[derive(Debug, clap::Args)]
pub struct Args {
    /// Which rig, and how it is run.
    #[command(flatten)]
    pub run: RunArgs,

    /// Shows a recorded stream of the binary channel, as fast as it was.
    #[arg(long, value_name = "FILE", conflicts_with = "target")]
    stream: Option<PathBuf>,

    /// What runs the controller: sil, this host; board, an emulated board; or probe, a
    /// real one.
    #[arg(long, value_name = "TARGET", default_value = "sil")]
    target: String,

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

    /// Writes the last screen as a picture, SVG.
    #[arg(long, value_name = "FILE")]
    picture: Option<PathBuf>,
}

/// Runs the verb.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    if !args.headless && !std::io::stdout().is_terminal() {
        return Err(Failure::input("standard output is no terminal: use --headless"));
    }
    if let Some(path) = &args.stream {
        let name = path.display().to_string();
        let file = File::open(path).map_err(|error| Failure::input(format!("{name}: {error}")))?;
        return watch(args, &mut Bytes::new(name, Box::new(file)));
    }
    let scenario = args.run.resolve()?;
    match args.target.as_str() {
        "sil" => watch(args, &mut Virtual::new(&scenario, !args.headless)?),
        "board" => board(args, &scenario),
        "probe" => probe(args),
        other => Err(Failure::input(format!(
            "--target {other}: not available; available targets: sil, board, probe"
        ))),
    }
}

#[cfg(not(feature = "probe"))]
fn probe(_: &Args) -> Result<Outcome, Failure> {
    Ok(Outcome::Code(crate::provision::go_on(crate::provision::Extra::Probe)?))
}

#[cfg(feature = "probe")]
fn probe(args: &Args) -> Result<Outcome, Failure> {
    watch(args, &mut crate::capture::Probed::new(super::probe::patient()?))
}

fn board(_: &Args, _: &Scenario) -> Result<Outcome, Failure> {
    Ok(Outcome::Code(crate::provision::go_on(crate::provision::Extra::Board)?))
}

/// A terminal that is given back however the view ends.
struct Display(ratatui::DefaultTerminal);

impl Drop for Display {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// Shows what `source` gives until it ends or the operator does.
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
            if let crate::log::Item::Tick(record, _) = &item {
                clock.tick(record.at());
            }
            if let Some((topic, body)) = messages(&item) {
                server.publish(topic, clock.now_ns(), body);
            }
        });
        for line in source.news() {
            screen.note(line);
        }
        screen.count(decoder.tally());
        clock.wait();
        if drawn.elapsed() < REDRAW {
            continue;
        }
        drawn = Instant::now();
        if let Some(Display(terminal)) = &mut display {
            let drawn = terminal.draw(|frame| screen.draw(frame, decoder.tally()));
            drawn.map_err(Failure::run)?;
            match key()? {
                Some(Key::Quit) => break,
                Some(Key::Letter(letter)) => source.send(letter).map_err(Failure::run)?,
                None => {}
            }
        }
    }
    drop(display);
    if let Some(path) = &args.picture {
        write_text(path, &picture(&screen, &decoder)?)?;
    }
    let tally = decoder.tally();
    Ok(Outcome::of(tally.ticks > 0 && tally.lost_frames == 0 && tally.lost_ticks == 0))
}

fn picture(screen: &Screen, decoder: &Decoder) -> Result<String, Failure> {
    let backend = TestBackend::new(PICTURE.0, PICTURE.1);
    let mut terminal = Terminal::new(backend).map_err(Failure::run)?;
    terminal.draw(|frame| screen.draw(frame, decoder.tally())).map_err(Failure::run)?;
    Ok(svg(terminal.backend().buffer()))
}

/// What the operator wants.
enum Key {
    Quit,
    Letter(u8),
}

/// The key that was pressed, if one was.
fn key() -> Result<Option<Key>, Failure> {
    if !event::poll(Duration::ZERO).map_err(Failure::run)? {
        return Ok(None);
    }
    let Event::Key(key) = event::read().map_err(Failure::run)? else { return Ok(None) };
    if key.kind != KeyEventKind::Press {
        return Ok(None);
    }
    Ok(match key.code {
        KeyCode::Char('q') | KeyCode::Esc => Some(Key::Quit),
        // The terminal does not end the program by itself while it is drawn on.
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Key::Quit),
        KeyCode::Char(letter @ ('s' | 'x' | 'r' | '0')) => Some(Key::Letter(letter as u8)),
        _ => None,
    })
}

/// The log's time against this host's.
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

    /// The log has come to this tick. A target that starts anew starts the clock anew.
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
