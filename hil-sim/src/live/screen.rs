//! The log on a terminal: state, rolling plots, events, keys.

use std::collections::VecDeque;

use interstage::estimate::ContactStage;
use interstage::log::identity::fingerprint;
use interstage::model::Planner;
use interstage::restart::Reset;
use interstage::rig::{Rig, RigError};
use interstage::supervise::Mode;
use interstage::tick::{Entry, Event};
use interstage::units::Direction;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph};

use super::plot::{PLOTS, Row, SPAN_S};
use crate::record::{Columns, Counts, Item, LedgerLine, Mark, View, shown, text};
use crate::report::Geometry;

/// Ticks between two points of a plot.
const EVERY: u32 = 10;
/// Lines of the log that are kept.
const LINES: usize = 64;
/// Least width of a terminal that has all plots, and least height with the larger log.
const WIDE: (u16, u16) = (120, 36);

/// The last line: what the keys do.
const KEYS: &str =
    " s start   SPACE or x stop   r retract   0 reset   q quit: a real drive runs on ";

/// What the log is compared with.
pub(crate) struct Known {
    geometry: Geometry,
    /// Reference gap in each direction, mm.
    gap_ref_mm: [f64; 2],
    /// Hash of the rig's parameters.
    hash: u32,
}

impl Known {
    /// The rig that the target is said to have.
    pub(crate) fn of(rig: &Rig) -> Result<Self, RigError> {
        let planner = Planner::try_build(rig)?;
        Ok(Self {
            geometry: Geometry::of_rig(rig),
            gap_ref_mm: Direction::ALL.map(|direction| planner.gap_ref(direction).to_num()),
            hash: fingerprint(rig),
        })
    }
}

/// The state of the terminal.
pub(crate) struct Screen {
    known: Known,
    /// Where the log goes: address, files.
    places: String,
    view: View,
    rows: VecDeque<Row>,
    /// Time since boot at which the lower wall last let go, or carried again, s.
    lifted_s: f64,
    stage: u8,
    is_other: bool,
    lines: VecDeque<(Color, String)>,
}

impl Screen {
    /// Before the first item. `places` says where the log goes.
    pub(crate) fn new(known: Known, places: String) -> Self {
        Self {
            known,
            places,
            view: View::default(),
            rows: VecDeque::new(),
            lifted_s: f64::NAN,
            stage: 0,
            is_other: false,
            lines: VecDeque::new(),
        }
    }

    pub(crate) fn see(&mut self, item: &Item) {
        self.view.see(item);
        match item {
            Item::Tick(record, sensors) => {
                let row = shown(record, sensors);
                let on_corner = [ContactStage::StaticFriction, ContactStage::Sliding];
                let was_there =
                    on_corner.iter().all(|at| [self.stage, row.stage].contains(&(*at as u8)));
                if was_there {
                    self.lifted_s = row.t_s;
                }
                self.stage = row.stage;
                if record.at().is_multiple_of(EVERY) {
                    self.add_row(row);
                }
            }
            Item::Ledger(line) => {
                let gap_mm = LedgerLine::from(line).gap_measured_mm;
                let near = |row: &&mut Row| (row.seen.t_s - self.lifted_s).abs() <= 0.01;
                if let Some(row) = self.rows.iter_mut().rev().find(near) {
                    row.gap_mm = gap_mm;
                }
            }
            Item::Identity(identity) if identity.parameters != self.known.hash => {
                if !self.is_other {
                    self.note(
                        "the target has other parameters: clearance and wanted gap are not its own"
                            .to_owned(),
                    );
                }
                self.is_other = true;
            }
            Item::Event(entry) => {
                let t_s = f64::from(entry.at) * 1e-3;
                self.add(colour(entry), format!("{t_s:9.3} s  {}", text(&entry.event)));
            }
            Item::Mark(mark) => {
                if *mark == Mark::Restart {
                    self.rows.clear();
                }
                self.note(mark.to_string());
            }
            _ => {}
        }
    }

    fn add_row(&mut self, seen: Columns) {
        let clearance_mm = self.known.geometry.clearance_mm(seen.position_mm, seen.radius_mm);
        let gap_ref_mm = self.known.gap_ref_mm[usize::from(seen.retracts)];
        self.rows.push_back(Row { seen, clearance_mm, gap_ref_mm, gap_mm: f64::NAN });
        while self.rows.front().is_some_and(|first| first.seen.t_s < seen.t_s - SPAN_S) {
            self.rows.pop_front();
        }
    }

    /// Shows a line about the connection.
    pub(crate) fn note(&mut self, text: String) {
        self.add(Color::LightRed, text);
    }

    fn add(&mut self, colour: Color, text: String) {
        self.lines.push_back((colour, text));
        while self.lines.len() > LINES {
            self.lines.pop_front();
        }
    }

    pub(crate) fn count(&mut self, counts: &Counts) {
        self.view.count(counts);
    }

    pub(crate) fn draw(&self, frame: &mut Frame<'_>, counts: &Counts) {
        let Rect { width, height, .. } = frame.area();
        let log_lines = if height < WIDE.1 { 4 } else { 10 };
        let [head, plots, log, keys] = Layout::vertical([
            Constraint::Length(5),
            Constraint::Min(8),
            Constraint::Length(log_lines),
            Constraint::Length(1),
        ])
        .areas(frame.area());
        let state = self.view.row().map_or(" no tick yet".to_owned(), |_| self.view.state_text());
        let [upper, lower] =
            Layout::vertical([Constraint::Length(3), Constraint::Length(2)]).areas(head);
        frame.render_widget(Paragraph::new(state).style(self.style()), upper);
        let connection = format!(" {}\n {}", self.view.rates_text(counts), self.places);
        frame.render_widget(Paragraph::new(connection), lower);

        let columns = if width < WIDE.0 { 2 } else { 3 };
        let rows = Layout::vertical([Constraint::Fill(1); 2]).split(plots);
        let cells = rows.iter().flat_map(|row| {
            Layout::horizontal(vec![Constraint::Fill(1); columns]).split(*row).to_vec()
        });
        let end_s = self.rows.back().map_or(SPAN_S, |row| row.seen.t_s.max(SPAN_S));
        for (plot, area) in PLOTS.iter().zip(cells) {
            plot.draw(frame, area, &self.rows, end_s);
        }

        let skip = self.lines.len().saturating_sub(usize::from(log.height.saturating_sub(2)));
        let lines = self.lines.iter().skip(skip);
        let line = |(colour, text): &(Color, String)| {
            Line::styled(cut(text, log.width.saturating_sub(2)), Style::new().fg(*colour))
        };
        let lines: Vec<Line<'_>> = lines.map(line).collect();
        let block = Block::bordered().title("log; the plots show its last 10 s");
        frame.render_widget(Paragraph::new(lines).block(block), log);
        let style = Style::new().fg(Color::Black).bg(Color::Gray);
        frame.render_widget(Paragraph::new(KEYS).style(style), keys);
    }

    /// Style of the state: red in a fault, green while the drive moves.
    fn style(&self) -> Style {
        let strong = Style::new().add_modifier(Modifier::BOLD);
        match self.view.row().and_then(Columns::mode) {
            Some(Mode::FaultHold(_)) => strong.fg(Color::Red),
            Some(mode) if mode.moves() => strong.fg(Color::Green),
            _ => strong,
        }
    }
}

/// `text` in so many columns; an ellipsis is at the end of a longer one.
fn cut(text: &str, columns: u16) -> String {
    match text.char_indices().nth(columns.into()) {
        Some(_) => text.chars().take(columns.saturating_sub(1).into()).chain(['…']).collect(),
        None => text.to_owned(),
    }
}

fn colour(entry: &Entry) -> Color {
    match entry.event {
        Event::Fault(_) => Color::Red,
        Event::Restart(restart) if restart.reset != Reset::Power => Color::Red,
        Event::Limit(_) | Event::Lost(_) | Event::Refused(_) => Color::Magenta,
        Event::Crossing(_) => Color::Cyan,
        _ => Color::Reset,
    }
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;
    use crate::record::Decoder;
    use crate::scenario::Scenario;
    use crate::session;

    fn screen() -> Screen {
        let known = Known::of(&Scenario::default().rig).unwrap();
        Screen::new(known, "ws://127.0.0.1:8765   recorded to out/live/log.mcap".to_owned())
    }

    /// The lines of a terminal of this size at the end of a run.
    fn drawn(scenario: &Scenario, width: u16, height: u16) -> Vec<String> {
        let stream = session::run(scenario, session::Options::ROWS).unwrap().stream;
        let (mut screen, mut decoder) = (screen(), Decoder::new());
        decoder.read(&stream, &mut |item| screen.see(&item));
        lines(&screen, decoder.counts(), width, height)
    }

    fn lines(screen: &Screen, counts: &Counts, width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| screen.draw(frame, counts)).unwrap();
        let cells = terminal.backend().buffer().content();
        let text = |line: &[ratatui::buffer::Cell]| line.iter().map(|cell| cell.symbol()).collect();
        cells.chunks(width.into()).map(text).collect()
    }

    #[test]
    fn small_and_large_terminals_have_state_legends_log_and_keys() {
        let always = [
            "deployed",
            "contact: continuous",
            "level 3",
            " N",
            "slip margin ",
            "lost 0 frames",
            "ws://127.0.0.1:8765",
            "recorded to out/live/log.mcap",
            "speed, mm/s ─reference ─estimated",
            "preload, N ─reference ─measured",
            "gap, mm ─wanted ─clearance •measured",
            "compression, mm ─measured",
            "mode: deployed",
            " s──",
            "SPACE or x stop",
            "a real drive runs on",
        ];
        let wide = ["radius, mm ─from the arm angle", "slip margin ─planned", "crossing 3 at"];
        for (width, height, more) in [(80, 24, &wide[..0]), (140, 50, &wide)] {
            let lines = drawn(&Scenario::default(), width, height);
            let text = lines.join("\n");
            for part in always.iter().chain(more) {
                assert!(text.contains(part), "{width}x{height}: no {part} in\n{text}");
            }
            let cut = lines.iter().any(|line| line.contains("crossing 3") && line.ends_with("…│"));
            assert!(cut || width == 80, "{text}");
            // Nothing ends at the edge: the last column of the lines above the plots is free.
            for line in &lines[..5] {
                assert!(line.ends_with(' '), "{line}");
            }
            let dots = |c: &char| ('\u{2801}'..='\u{28ff}').contains(c);
            assert!(text.chars().filter(dots).count() > 100, "{text}");
            // Three crossings, three gaps, and the one of the legend.
            assert_eq!(text.matches('•').count(), 4, "{text}");
        }
    }

    #[test]
    fn nothing_yet_is_drawn_too_and_a_tiny_terminal_ends_nothing() {
        for (width, height) in [(60, 26), (20, 5), (1, 1)] {
            let lines = lines(&screen(), &Counts::default(), width, height);
            assert!(width < 60 || lines.join("\n").contains("no tick yet"));
        }
    }

    #[test]
    fn parameters_that_are_not_the_target_s_are_told() {
        let slow = ["drive.cruise_speed_mm_s=20".to_owned()];
        let scenario = Scenario::default().with(&slow).unwrap();
        let stream = session::run(&scenario, session::Options::ROWS).unwrap().stream;
        let (mut screen, mut decoder) = (screen(), Decoder::new());
        decoder.read(&stream[..40_000], &mut |item| screen.see(&item));
        let said = |text: &str| screen.lines.iter().filter(|line| line.1.contains(text)).count();
        assert_eq!(said("other parameters"), 1);
    }
}
