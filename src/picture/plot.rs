//! Plots of errors over spacings: both axes logarithmic, with lines of known slopes to compare with.

use super::canvas::{Canvas, Pen, Picture, single};
use super::colour::{self, Linear, mix};
use super::text::{self, Align, Run};

/// A line of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Series<'a> {
    /// What it is called in the legend.
    pub name: &'a str,
    /// Points (x, y); those that are not greater than 0 are left out.
    pub points: Vec<[f64; 2]>,
}

/// One pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel<'a> {
    /// What stands above it.
    pub title: &'a str,
    /// What the x axis shows, with its unit.
    pub x: &'a str,
    /// What the y axis shows, with its unit.
    pub y: &'a str,
    /// The lines.
    pub series: Vec<Series<'a>>,
    /// Slopes that reference lines are drawn for.
    pub slopes: &'a [u32],
}

/// Width and height of one panel, in pixels.
const PANEL: [f32; 2] = [900.0, 810.0];
/// Size of the text, in pixels.
const SIZE: f32 = 19.0;
/// Where the axes are in a panel: left, right, top, bottom.
const FRAME: [f32; 4] = [118.0, 870.0, 60.0, 632.0];

/// Panels side by side.
#[must_use]
pub fn log_plot(panels: &[Panel]) -> Picture {
    let width = super::canvas::whole(PANEL[0]) * panels.len().max(1);
    let mut canvas = Canvas::new(width, super::canvas::whole(PANEL[1]), [1.0; 3]);
    for (n, panel) in panels.iter().enumerate() {
        let left = PANEL[0] * single(super::canvas::length(n));
        Axes::new(panel, left).draw(&mut canvas, panel);
    }
    canvas.finish(false)
}

struct Axes {
    left: f32,
    /// Decimal logarithms at the ends of both axes.
    x: [f64; 2],
    y: [f64; 2],
}

fn ink() -> Linear {
    colour::linear(colour::INK)
}

impl Axes {
    fn new(panel: &Panel, left: f32) -> Self {
        let all = || panel.series.iter().flat_map(|s| &s.points);
        let range = |axis: usize| {
            let shown = all().filter(|p| p[0] > 0.0 && p[1] > 0.0);
            let logs = shown.map(|p| p[axis].log10());
            let [low, high] = logs.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| {
                [a.min(v), b.max(v)]
            });
            if low <= high {
                [low, high]
            } else {
                [-1.0, 0.0]
            }
        };
        let ([x0, x1], [y0, y1]) = (range(0), range(1));
        let room = 0.06 * (x1 - x0).max(0.5);
        Self {
            left,
            x: [x0 - room, x1 + room],
            y: [y0.floor(), y1.ceil().max(y0.floor() + 1.0)],
        }
    }

    fn at(&self, log: [f64; 2]) -> [f32; 2] {
        let share = |v: f64, [low, high]: [f64; 2]| single((v - low) / (high - low));
        let [left, right, top, bottom] = FRAME;
        [
            self.left + left + (right - left) * share(log[0], self.x),
            bottom - (bottom - top) * share(log[1], self.y),
        ]
    }

    fn draw(&self, canvas: &mut Canvas, panel: &Panel) {
        self.grid(canvas);
        self.references(canvas, panel);
        for (n, series) in panel.series.iter().enumerate() {
            self.line(canvas, series, colour::material(n));
        }
        let [left, right, top, bottom] = FRAME;
        let (low, high) = ([self.left + left, top], [self.left + right, bottom]);
        canvas.frame(low, high, Pen::solid(1.5, ink()));
        let middle = self.left + 0.5 * (left + right);
        let write = |canvas: &mut Canvas, text: &str, size: f32, at: [f32; 2], run: Run| {
            text::draw(canvas, text, size, at, (Align::Middle, run), ink());
        };
        let above = [middle, top - 1.1 * SIZE];
        write(canvas, panel.title, 1.15 * SIZE, above, Run::Right);
        let below = [middle, bottom + 3.4 * SIZE];
        write(canvas, panel.x, SIZE, below, Run::Right);
        let beside = [self.left + 1.6 * SIZE, 0.5 * (top + bottom)];
        write(canvas, panel.y, SIZE, beside, Run::Up);
        self.legend(canvas, panel);
    }

    /// Lines at powers of ten, and on the x axis at 2 and 5 times those.
    fn grid(&self, canvas: &mut Canvas) {
        let [left, right, top, bottom] = FRAME;
        let faint = Pen::solid(1.0, mix([1.0; 3], ink(), 0.16));
        for y in powers(self.y) {
            let v = self.at([self.x[0], y])[1];
            canvas.line([self.left + left, v], [self.left + right, v], faint);
            let at = [self.left + left - 0.5 * SIZE, v + 0.36 * SIZE];
            power(canvas, y, at);
        }
        for x in powers([self.x[0] - 1.0, self.x[1]]) {
            for factor in [1.0_f64, 2.0, 5.0] {
                let log = x + factor.log10();
                if log < self.x[0] || log > self.x[1] {
                    continue;
                }
                let u = self.at([log, self.y[0]])[0];
                canvas.line([u, top], [u, bottom], faint);
                let label = plain(factor, x);
                let at = [u, bottom + 1.5 * SIZE];
                text::draw(
                    canvas,
                    &label,
                    0.9 * SIZE,
                    at,
                    (Align::Middle, Run::Right),
                    ink(),
                );
            }
        }
    }

    /// Dashed lines of known slopes, through the last point of the first series.
    fn references(&self, canvas: &mut Canvas, panel: &Panel) {
        let Some(anchor) = panel
            .series
            .iter()
            .flat_map(|s| &s.points)
            .filter(|p| p[0] > 0.0 && p[1] > 0.0)
            .max_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])))
        else {
            return;
        };
        let [x0, y0] = anchor.map(f64::log10);
        for (n, &slope) in panel.slopes.iter().enumerate() {
            let p = f64::from(slope);
            // As far down as the axes go.
            let end = self.x[0].max(x0 - (y0 - self.y[0]) / p);
            let (from, to) = (self.at([x0, y0]), self.at([end, y0 + p * (end - x0)]));
            canvas.line(from, to, reference(n));
        }
    }

    fn line(&self, canvas: &mut Canvas, series: &Series, colour: Linear) {
        let mut shown: Vec<[f64; 2]> = series
            .points
            .iter()
            .filter(|p| p[0] > 0.0 && p[1] > 0.0)
            .map(|p| p.map(f64::log10))
            .collect();
        shown.sort_by(|a, b| a[0].total_cmp(&b[0]));
        for pair in shown.windows(2) {
            canvas.line(self.at(pair[0]), self.at(pair[1]), Pen::solid(2.4, colour));
        }
        for &p in &shown {
            marker(canvas, self.at(p), colour);
        }
    }

    /// The names below the axes, the reference lines last.
    fn legend(&self, canvas: &mut Canvas, panel: &Panel) {
        let slopes: Vec<String> = panel.slopes.iter().map(|s| format!("order {s}")).collect();
        let names = panel.series.iter().map(|s| s.name);
        let names = names.chain(slopes.iter().map(String::as_str));
        let [left, right, _, bottom] = FRAME;
        let start = [self.left + left, bottom + 5.6 * SIZE];
        let [mut x, mut y] = start;
        for (n, name) in names.enumerate() {
            let wide = 2.6 * SIZE + text::width(name, 0.95 * SIZE);
            if x > start[0] && x + wide > self.left + right {
                (x, y) = (start[0], y + 1.6 * SIZE);
            }
            let (a, b) = ([x, y], [x + 2.0 * SIZE, y]);
            if n < panel.series.len() {
                canvas.line(a, b, Pen::solid(2.4, colour::material(n)));
                marker(canvas, [x + SIZE, y], colour::material(n));
            } else {
                canvas.line(a, b, reference(n - panel.series.len()));
            }
            let at = [x + 2.4 * SIZE, y + 0.34 * SIZE];
            text::draw(
                canvas,
                name,
                0.95 * SIZE,
                at,
                (Align::Start, Run::Right),
                ink(),
            );
            x += wide + 1.4 * SIZE;
        }
    }
}

/// How the reference line number `n` is drawn.
fn reference(n: usize) -> Pen<'static> {
    Pen {
        half_width: 0.9,
        colour: mix([1.0; 3], ink(), 0.55),
        dashes: if n == 0 { &[9.0, 6.0] } else { &[2.5, 5.0] },
    }
}

/// A disc.
fn marker(canvas: &mut Canvas, [x, y]: [f32; 2], colour: Linear) {
    const RADIUS: f32 = 5.0;
    let reach = 7_i16;
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let (px, py) = (x.floor() + f32::from(dx), y.floor() + f32::from(dy));
            let off = (px + 0.5 - x).hypot(py + 0.5 - y);
            #[allow(
                clippy::cast_possible_truncation,
                reason = "a float to integer cast saturates"
            )]
            canvas.blend(px as isize, py as isize, colour, RADIUS + 0.5 - off);
        }
    }
}

/// The whole numbers in a range.
fn powers([low, high]: [f64; 2]) -> Vec<f64> {
    let mut found = Vec::new();
    let mut at = low.ceil();
    while at <= high && found.len() < 64 {
        found.push(at);
        at += 1.0;
    }
    found
}

/// 10 to a power, ending at a point.
fn power(canvas: &mut Canvas, exponent: f64, [x, y]: [f32; 2]) {
    let exponent = format!("{exponent:.0}").replace('-', "\u{2212}");
    let small = 0.7 * SIZE;
    let end = (Align::End, Run::Right);
    text::draw(canvas, &exponent, small, [x, y - 0.45 * SIZE], end, ink());
    let left = x - text::width(&exponent, small);
    text::draw(canvas, "10", SIZE, [left, y], end, ink());
}

/// A factor times a power of ten, as a person writes it.
fn plain(factor: f64, exponent: f64) -> String {
    let value = factor * 10_f64.powf(exponent);
    if (1e-3..1e4).contains(&value) {
        let digits = if exponent < 0.0 { -exponent } else { 0.0 };
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most 3"
        )]
        let digits = digits as usize;
        format!("{value:.digits$}")
    } else {
        format!("{factor}e{exponent}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(points: Vec<[f64; 2]>) -> Panel<'static> {
        Panel {
            title: "t",
            x: "x",
            y: "y",
            series: vec![Series { name: "s", points }],
            slopes: &[1, 2],
        }
    }

    fn has(picture: &Picture, at: [f32; 2], wanted: Linear) -> bool {
        let close = |found: [u8; 3]| {
            let wanted = colour::encoded(wanted);
            found
                .iter()
                .zip(wanted)
                .all(|(&f, w)| (f32::from(f) - w).abs() < 3.0)
        };
        close(picture.pixel(
            super::super::canvas::whole(at[0]),
            super::super::canvas::whole(at[1]),
        ))
    }

    #[test]
    fn points_are_where_the_axes_say() {
        let points = vec![[1.0, 2e-2], [0.1, 2e-4]];
        let panel = panel(points);
        let axes = Axes::new(&panel, 0.0);
        let picture = log_plot(&[panel]);
        let two = 2_f64.log10();
        for log in [[0.0, two - 2.0], [-1.0, two - 4.0], [-0.5, two - 3.0]] {
            assert!(has(&picture, axes.at(log), colour::material(0)), "{log:?}");
        }
        assert!(!has(
            &picture,
            axes.at([-0.5, two - 3.4]),
            colour::material(0)
        ));
        let [low, high] = [axes.at([-1.0, -3.0]), axes.at([0.0, -2.0])];
        assert!(low[0] < high[0] && low[1] > high[1]);
    }

    #[test]
    fn nothing_can_be_plotted() {
        for points in [
            vec![],
            vec![[0.0, 0.0]],
            vec![[1.0, 0.0], [f64::NAN, 1.0]],
            vec![[1.0, 1.0]],
        ] {
            let picture = log_plot(&[panel(points.clone()), panel(points)]);
            assert_eq!(picture.width(), 1800);
        }
    }

    #[test]
    fn labels_are_plain_numbers() {
        assert_eq!(plain(5.0, -2.0), "0.05");
        assert_eq!(plain(2.0, 1.0), "20");
        assert_eq!(plain(1.0, -5.0), "1e-5");
    }
}
