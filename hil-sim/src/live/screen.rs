//! The log on a terminal: state, rolling plots, what happened, keys.

use std::collections::VecDeque;

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph};

use interstage::restart::Reset;
use interstage::supervise::Mode;
use interstage::tick::{Entry, Event};

use crate::capture::{View, mode_name};
use crate::log::{Item, Row, Tally};
use crate::record::STAGE_NAMES;
use crate::sil;

/// What the plots show, s.
const SPAN_S: f64 = 10.0;
/// Ticks from one point of a plot to the next.
const EVERY: u32 = 10;
/// Lines of the log that are kept.
const LINES: usize = 64;

/// What stands at the bottom.
const KEYS: &str = " s start   x stop   r retract   0 reset   q quit ";

/// A line of a plot: name, colour, value.
type Curve = (&'static str, Color, fn(&Row) -> f64);

/// A plot: title with unit, least span, and its lines, the later above the earlier.
struct Plot {
    title: &'static str,
    least: f64,
    lines: [Option<Curve>; 2],
}

const PLOTS: [Plot; 4] = [
    Plot {
        title: "speed, mm/s",
        least: 2.0,
        lines: [
            Some(("wanted", Color::Gray, |row| row.speed_ref_mm_s)),
            Some(("estimated", Color::Cyan, |row| row.speed_mm_s)),
        ],
    },
    Plot {
        title: "preload, N",
        least: 4.0,
        lines: [
            Some(("wanted", Color::Gray, |row| row.preload_ref_n)),
            Some(("measured", Color::Yellow, |row| row.preload_n)),
        ],
    },
    Plot {
        title: "tread compression, mm",
        least: 0.2,
        lines: [Some(("measured", Color::Green, |row| row.compression_mm)), None],
    },
    Plot {
        title: "wheel centre from the axis, mm",
        least: 2.0,
        lines: [Some(("by the arm", Color::Magenta, |row| row.radius_mm)), None],
    },
];

/// What the terminal shows.
#[derive(Default)]
pub struct Screen {
    view: View,
    rows: VecDeque<Row>,
    lines: VecDeque<(Color, String)>,
    mode: Option<Mode>,
}

impl Screen {
    /// Takes an item in.
    pub fn see(&mut self, item: &Item) {
        self.view.see(item);
        match item {
            Item::Tick(record, sensors) => {
                self.mode = Some(record.telemetry.mode);
                if record.at().is_multiple_of(EVERY) {
                    self.keep(Row::of(record, sensors));
                }
            }
            Item::Event(entry) => self.say(colour(entry), line(entry)),
            Item::Mark(mark) => {
                if *mark == crate::log::Mark::Restart {
                    self.rows.clear();
                }
                self.say(Color::LightRed, mark.to_string());
            }
            _ => {}
        }
    }

    /// Shows a line about the way to the board.
    pub fn note(&mut self, text: String) {
        self.say(Color::LightRed, text);
    }

    fn keep(&mut self, row: Row) {
        self.rows.push_back(row);
        while self.rows.front().is_some_and(|first| first.t_s < row.t_s - SPAN_S) {
            self.rows.pop_front();
        }
    }

    fn say(&mut self, colour: Color, text: String) {
        self.lines.push_back((colour, text));
        while self.lines.len() > LINES {
            self.lines.pop_front();
        }
    }

    /// Works the rates out now and then.
    pub fn count(&mut self, tally: &Tally) {
        self.view.count(tally);
    }

    /// Draws everything.
    pub fn draw(&self, frame: &mut Frame<'_>, tally: &Tally) {
        let [head, plots, log, keys] = Layout::vertical([
            Constraint::Length(4),
            Constraint::Min(12),
            Constraint::Length(8),
            Constraint::Length(1),
        ])
        .areas(frame.area());
        frame.render_widget(self.head(tally), head);
        let [upper, lower] = Layout::vertical([Constraint::Fill(1); 2]).areas(plots);
        let cells =
            [upper, lower].map(|row| Layout::horizontal([Constraint::Fill(1); 2]).areas::<2>(row));
        for (plot, area) in PLOTS.iter().zip(cells.into_iter().flatten()) {
            self.plot(frame, plot, area);
        }
        frame.render_widget(self.log(log.height), log);
        let style = Style::new().fg(Color::Black).bg(Color::Gray);
        frame.render_widget(Paragraph::new(KEYS).style(style), keys);
    }

    fn head(&self, tally: &Tally) -> Paragraph<'_> {
        let strong = Style::new().add_modifier(Modifier::BOLD);
        let mode = self.mode.map_or("no frame yet", mode_name);
        let style = match self.mode {
            Some(Mode::FaultHold(_)) => strong.fg(Color::Red),
            Some(mode) if mode.moves() => strong.fg(Color::Green),
            _ => strong,
        };
        let row = self.view.row();
        let stage = row.and_then(|row| STAGE_NAMES.get(usize::from(row.stage).wrapping_sub(1)));
        let mut lines = vec![Line::from(vec![
            Span::styled(format!(" {mode} "), style),
            Span::raw(format!(
                " contact: {}   level {}   {:.3} s",
                stage.unwrap_or(&"?"),
                row.map_or(0, |row| row.level),
                row.map_or(0.0, |row| row.t_s),
            )),
        ])];
        if let Some(row) = row {
            lines.push(Line::raw(format!(
                " position {:8.3} mm   next face in {:8.3} mm   gap predicted {:6.3} mm   slip margin {:5.2}",
                row.position_mm,
                row.distance_mm.min(999.999),
                row.gap_predicted_mm,
                row.slip_margin,
            )));
        }
        lines.push(Line::raw(format!(" {}", self.view.rates_text(tally))));
        Paragraph::new(lines)
    }

    fn plot(&self, frame: &mut Frame<'_>, plot: &Plot, area: Rect) {
        let lines: Vec<_> = plot
            .lines
            .iter()
            .flatten()
            .map(|(name, colour, of)| {
                let points: Vec<(f64, f64)> =
                    self.rows.iter().map(|row| (row.t_s, of(row))).collect();
                (*name, *colour, points)
            })
            .collect();
        let values = lines.iter().flat_map(|(_, _, points)| points.iter().map(|point| point.1));
        let (low, high) = range(values, plot.least);
        let end = self.rows.back().map_or(SPAN_S, |row| row.t_s.max(SPAN_S));
        let sets = lines
            .iter()
            .map(|(name, colour, points)| {
                Dataset::default()
                    .name(*name)
                    .marker(Marker::Braille)
                    .graph_type(GraphType::Line)
                    .style(Style::new().fg(*colour))
                    .data(points)
            })
            .collect();
        let label = |value: f64| Line::from(format!("{value:.1}"));
        let chart = Chart::new(sets)
            .block(Block::bordered().title(plot.title))
            .x_axis(
                Axis::default()
                    .bounds([end - SPAN_S, end])
                    .labels([label(end - SPAN_S), label(end)]),
            )
            .y_axis(Axis::default().bounds([low, high]).labels([
                label(low),
                label(0.5 * (low + high)),
                label(high),
            ]));
        frame.render_widget(chart, area);
    }

    fn log(&self, height: u16) -> Paragraph<'_> {
        let most = usize::from(height.saturating_sub(2));
        let skip = self.lines.len().saturating_sub(most);
        let lines: Vec<Line<'_>> = self
            .lines
            .iter()
            .skip(skip)
            .map(|(colour, text)| Line::styled(text.as_str(), Style::new().fg(*colour)))
            .collect();
        Paragraph::new(lines).block(Block::bordered().title("log"))
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

fn line(entry: &Entry) -> String {
    format!("{:9.3} s  {}", f64::from(entry.at) * 1e-3, sil::text(&entry.event))
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
pub(super) mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use ratatui::buffer::Buffer;

    use super::*;
    use crate::log::Decoder;
    use crate::scenario::Scenario;

    /// The screen at the end of a run.
    pub(in crate::live) fn drawn() -> Buffer {
        let options = sil::Options { rows: true, ..sil::Options::default() };
        let stream = sil::run(&Scenario::default(), options).unwrap().stream;
        let (mut screen, mut decoder) = (Screen::default(), Decoder::new());
        decoder.read(&stream, &mut |item| screen.see(&item));
        let mut terminal = Terminal::new(TestBackend::new(110, 36)).unwrap();
        terminal.draw(|frame| screen.draw(frame, decoder.tally())).unwrap();
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
        terminal.draw(|frame| screen.draw(frame, &Tally::default())).unwrap();
        assert!(text(terminal.backend().buffer()).contains("no frame yet"));
    }

    #[test]
    fn a_range_is_never_narrower_than_asked() {
        assert_eq!(range([1.0, 2.0].into_iter(), 4.0), (-0.5, 3.5));
        assert_eq!(range([f64::NAN].into_iter(), 4.0), (0.0, 4.0));
        assert_eq!(range([0.0, 9.0].into_iter(), 4.0), (0.0, 9.0));
    }
}
