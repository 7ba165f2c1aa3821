//! The log on a terminal: state, rolling plots, events, keys.

use std::collections::VecDeque;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph};

use interstage::restart::Reset;
use interstage::supervise::Mode;
use interstage::tick::{Entry, Event};

use crate::record::{Controller, Counts, Item, Mark, View, text};

/// Time span of the plots, s.
const SPAN_S: f64 = 10.0;
/// Ticks between two points of a plot.
const EVERY: u32 = 10;
/// Lines of the log that are kept.
const LINES: usize = 64;

/// The last line: what the keys do.
const KEYS: &str = " s start   x stop   r retract   0 reset   q quit ";

/// A line of a plot: name, colour, value.
type Curve = (&'static str, Color, fn(&Controller) -> f64);

/// Plots: title with unit, least span, and curves; later ones are drawn on top.
const PLOTS: [(&str, f64, &[Curve]); 4] = [
    (
        "speed, mm/s",
        2.0,
        &[
            ("reference", Color::Gray, |row| row.speed_ref_mm_s),
            ("estimated", Color::Cyan, |row| row.wheel_speed_mm_s),
        ],
    ),
    (
        "preload, N",
        4.0,
        &[
            ("reference", Color::Gray, |row| row.preload_ref_n),
            ("measured", Color::Yellow, |row| row.preload_n),
        ],
    ),
    ("tread compression, mm", 0.2, &[("measured", Color::Green, |row| row.compression_mm)]),
    ("wheel centre from the axis, mm", 2.0, &[("by the arm", Color::Magenta, |row| row.radius_mm)]),
];

/// The state of the terminal.
#[derive(Default)]
pub struct Screen {
    view: View,
    rows: VecDeque<Controller>,
    lines: VecDeque<(Color, String)>,
}

impl Screen {
    /// Takes an item.
    pub fn see(&mut self, item: &Item) {
        self.view.see(item);
        match item {
            Item::Tick(record, sensors) if record.at().is_multiple_of(EVERY) => {
                let row = Controller::of(record, sensors);
                self.rows.push_back(row);
                while self.rows.front().is_some_and(|first| first.t_s < row.t_s - SPAN_S) {
                    self.rows.pop_front();
                }
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

    /// Shows a line about the connection.
    pub fn note(&mut self, text: String) {
        self.add(Color::LightRed, text);
    }

    fn add(&mut self, colour: Color, text: String) {
        self.lines.push_back((colour, text));
        while self.lines.len() > LINES {
            self.lines.pop_front();
        }
    }

    /// Updates the rates.
    pub fn count(&mut self, counts: &Counts) {
        self.view.count(counts);
    }

    /// Draws everything.
    pub fn draw(&self, frame: &mut Frame<'_>, counts: &Counts) {
        let [head, plots, log, keys] = Layout::vertical([
            Constraint::Length(4),
            Constraint::Min(12),
            Constraint::Length(8),
            Constraint::Length(1),
        ])
        .areas(frame.area());
        let state = self.view.row().map_or("  no tick yet".to_owned(), |_| self.view.state_text());
        let state = format!("{state}\n {}", self.view.rates_text(counts));
        frame.render_widget(Paragraph::new(state).style(self.style()), head);
        let [upper, lower] = Layout::vertical([Constraint::Fill(1); 2]).areas(plots);
        let cells =
            [upper, lower].map(|row| Layout::horizontal([Constraint::Fill(1); 2]).areas::<2>(row));
        for (plot, area) in PLOTS.iter().zip(cells.into_iter().flatten()) {
            self.plot(frame, plot, area);
        }
        let skip = self.lines.len().saturating_sub(usize::from(log.height.saturating_sub(2)));
        let lines = self.lines.iter().skip(skip);
        let lines: Vec<Line<'_>> =
            lines.map(|(colour, text)| Line::styled(text, Style::new().fg(*colour))).collect();
        frame.render_widget(Paragraph::new(lines).block(Block::bordered().title("log")), log);
        let style = Style::new().fg(Color::Black).bg(Color::Gray);
        frame.render_widget(Paragraph::new(KEYS).style(style), keys);
    }

    /// Style of the state: red in a fault, green while the drive moves.
    fn style(&self) -> Style {
        let strong = Style::new().add_modifier(Modifier::BOLD);
        match self.view.row().and_then(Controller::mode) {
            Some(Mode::FaultHold(_)) => strong.fg(Color::Red),
            Some(mode) if mode.moves() => strong.fg(Color::Green),
            _ => strong,
        }
    }

    fn plot(
        &self,
        frame: &mut Frame<'_>,
        &(title, least, curves): &(&'static str, f64, &[Curve]),
        area: Rect,
    ) {
        let points = |of: fn(&Controller) -> f64| -> Vec<(f64, f64)> {
            self.rows.iter().map(|row| (row.t_s, of(row))).collect()
        };
        let lines: Vec<_> = curves.iter().map(|(.., of)| points(*of)).collect();
        let (low, high) = range(lines.iter().flatten().map(|point| point.1), least);
        let end = self.rows.back().map_or(SPAN_S, |row| row.t_s.max(SPAN_S));
        let sets = curves.iter().zip(&lines).map(|((name, colour, _), points)| {
            Dataset::default()
                .name(*name)
                .marker(Marker::Braille)
                .graph_type(GraphType::Line)
                .style(Style::new().fg(*colour))
                .data(points)
        });
        let axis = |low: f64, high: f64, labels: &[f64]| {
            let labels = labels.iter().map(|value| Line::from(format!("{value:.1}")));
            Axis::default().bounds([low, high]).labels(labels.collect::<Vec<_>>())
        };
        let chart = Chart::new(sets.collect())
            .block(Block::bordered().title(title))
            .x_axis(axis(end - SPAN_S, end, &[end - SPAN_S, end]))
            .y_axis(axis(low, high, &[low, 0.5 * (low + high), high]));
        frame.render_widget(chart, area);
    }
}

/// Range of the values, at least so wide.
fn range(values: impl Iterator<Item = f64>, least: f64) -> (f64, f64) {
    let values = values.filter(|value| value.is_finite());
    let (low, high) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return (0.0, least);
    }
    let lacking = (least - (high - low)).max(0.0);
    (low - 0.5 * lacking, high + 0.5 * lacking)
}

fn colour(entry: &Entry) -> Color {
    match entry.event {
        Event::Fault(_) => Color::Red,
        Event::Restart(restart) if restart.reset != Reset::Power => Color::Red,
        Event::Limit(_) | Event::Lost(_) | Event::Refused(_) => Color::Yellow,
        Event::Crossing(_) => Color::Cyan,
        _ => Color::Reset,
    }
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use ratatui::buffer::Buffer;

    use super::*;
    use crate::record::Decoder;
    use crate::scenario::Scenario;
    use crate::session;

    /// The screen at the end of a run.
    fn drawn() -> Buffer {
        let options = session::Options { rows: true, ..session::Options::default() };
        let stream = session::run(&Scenario::default(), options).unwrap().stream;
        let (mut screen, mut decoder) = (Screen::default(), Decoder::new());
        decoder.read(&stream, &mut |item| screen.see(&item));
        let mut terminal = Terminal::new(TestBackend::new(110, 36)).unwrap();
        terminal.draw(|frame| screen.draw(frame, decoder.counts())).unwrap();
        terminal.backend().buffer().clone()
    }

    fn text(buffer: &Buffer) -> String {
        buffer.content().iter().map(|cell| cell.symbol()).collect()
    }

    #[test]
    fn state_plots_log_and_keys_are_there() {
        let text = text(&drawn());
        for part in [
            "complete",
            "level 3",
            "speed, mm/s",
            "preload, N",
            "tread compression, mm",
            "crossing 3 at",
            "r retract",
            "lost 0 frames",
        ] {
            assert!(text.contains(part), "{part}");
        }
        let dots = text.chars().filter(|letter| ('\u{2801}'..='\u{28ff}').contains(letter)).count();
        assert!(dots > 100, "{dots} cells of the plots");
    }

    #[test]
    fn nothing_yet_is_drawn_too() {
        let mut terminal = Terminal::new(TestBackend::new(60, 26)).unwrap();
        let screen = Screen::default();
        terminal.draw(|frame| screen.draw(frame, &Counts::default())).unwrap();
        assert!(text(terminal.backend().buffer()).contains("no tick yet"));
    }

    #[test]
    fn a_range_is_never_narrower_than_asked() {
        assert_eq!(range([1.0, 2.0].into_iter(), 4.0), (-0.5, 3.5));
        assert_eq!(range([f64::NAN].into_iter(), 4.0), (0.0, 4.0));
        assert_eq!(range([0.0, 9.0].into_iter(), 4.0), (0.0, 9.0));
    }
}
