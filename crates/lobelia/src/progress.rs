//! Progress bars: drawn where standard error is a terminal, and a plain line now and then where it is a file or a log.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle, TermLike};
use std::{
    fmt::Write as _,
    io::{self, IsTerminal, Write},
    sync::{Arc, Mutex, OnceLock, PoisonError},
    time::{Duration, Instant},
};

/// Time between two lines where standard error is no terminal.
const PERIOD: Duration = Duration::from_secs(10);

/// A bar of `length` steps on standard error; nothing is shown if `quiet`.
pub fn bar(quiet: bool, length: u64) -> ProgressBar {
    if quiet {
        return ProgressBar::hidden();
    }
    let terminal = io::stderr().is_terminal();
    let (target, template) = if terminal {
        (ProgressDrawTarget::stderr(), "{bar:32} {percent:>3} %  {elapsed_precise} (left {left})  {msg}")
    } else {
        (
            ProgressDrawTarget::term_like(Box::new(Lines::new(io::stderr(), PERIOD))),
            "{percent:>3} %, {elapsed_precise} (left {left}), {msg}",
        )
    };
    let bar = ProgressBar::with_draw_target(Some(length), target);
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style.with_key("left", left()));
    }
    bar
}

/// Writes the time that is left, or a dash while nothing is known.
fn left() -> impl Fn(&ProgressState, &mut dyn std::fmt::Write) + Clone + Send + Sync + 'static {
    // Work that goes on where an earlier run stopped begins beyond 0, and that part took no time.
    let start = Arc::new(OnceLock::new());
    move |state: &ProgressState, out: &mut dyn std::fmt::Write| {
        let start = *start.get_or_init(|| state.pos());
        let (done, all) = (state.pos().saturating_sub(start), state.len().unwrap_or(0).saturating_sub(start));
        let text = remaining(state.elapsed(), done, all).map_or_else(|| "-".to_owned(), clock);
        // The text goes to memory, which does not fail.
        let _ = out.write_str(&text);
    }
}

/// Time that is left if the rest goes as fast as all so far did. The mean over everything is steadier than recent speed, which jumps between quick and slow
/// passes of a frame; it is rounded to what can be known of it.
fn remaining(elapsed: Duration, done: u64, all: u64) -> Option<Duration> {
    if done == 0 || elapsed < Duration::from_secs(1) {
        return None;
    }
    let seconds = elapsed.as_secs_f64() * all.saturating_sub(done) as f64 / done as f64;
    let step = match seconds {
        s if s < 20.0 => 1.0,
        s if s < 120.0 => 5.0,
        s if s < 1200.0 => 30.0,
        _ => 300.0,
    };
    Duration::try_from_secs_f64((seconds / step).ceil() * step).ok()
}

fn clock(time: Duration) -> String {
    let seconds = time.as_secs();
    let mut text = String::new();
    let _ = if seconds < 3600 {
        write!(text, "{}:{:02}", seconds / 60, seconds % 60)
    } else {
        write!(text, "{}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
    };
    text
}

/// Draws by writing a line, at most one in each period; the first comes when a period has passed, so that short work says nothing.
#[derive(Debug)]
struct Lines<W> {
    state: Mutex<State<W>>,
    period: Duration,
}

#[derive(Debug)]
struct State<W> {
    out: W,
    /// What is to be drawn next.
    line: String,
    last: Instant,
}

impl<W: Write> Lines<W> {
    fn new(out: W, period: Duration) -> Self {
        Self { state: Mutex::new(State { out, line: String::new(), last: Instant::now() }), period }
    }

    fn with(&self, change: impl FnOnce(&mut State<W>) -> io::Result<()>) -> io::Result<()> {
        change(&mut self.state.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl<W: Write + Send + std::fmt::Debug> TermLike for Lines<W> {
    fn width(&self) -> u16 {
        200
    }

    fn move_cursor_up(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_down(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_right(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn move_cursor_left(&self, _: usize) -> io::Result<()> {
        Ok(())
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.write_str(text)
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        self.with(|state| {
            state.line.push_str(text);
            Ok(())
        })
    }

    fn clear_line(&self) -> io::Result<()> {
        self.with(|state| {
            state.line.clear();
            Ok(())
        })
    }

    fn flush(&self) -> io::Result<()> {
        self.with(|state| {
            let line = std::mem::take(&mut state.line);
            if line.trim().is_empty() || state.last.elapsed() < self.period {
                return Ok(());
            }
            state.last = Instant::now();
            writeln!(state.out, "{}", line.trim())?;
            state.out.flush()
        })
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[derive(Clone, Debug, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn written(period: Duration) -> String {
        let out = Shared::default();
        let bar = ProgressBar::with_draw_target(Some(4), ProgressDrawTarget::term_like(Box::new(Lines::new(out.clone(), period))));
        bar.set_style(ProgressStyle::with_template("{percent:>3} %, (left {left}), {msg}").unwrap().with_key("left", left()));
        for step in 1..=4 {
            bar.set_message(format!("step {step}"));
            bar.set_position(step);
        }
        bar.finish_and_clear();
        String::from_utf8(out.0.lock().unwrap().clone()).unwrap()
    }

    #[test]
    fn off_a_terminal_there_are_whole_lines_and_few_of_them() {
        assert_eq!(written(Duration::from_secs(3600)), "");
        let lines = written(Duration::ZERO);
        assert!(lines.lines().any(|line| line == "50 %, (left -), step 2"), "{lines:?}");
        assert!(!lines.contains('\u{1b}') && !lines.contains('\r') && lines.ends_with('\n'), "{lines:?}");
    }

    #[test]
    fn time_left_is_steady() {
        let at = |seconds: u64, done: u64| remaining(Duration::from_secs(seconds), done, 100).map(|left| left.as_secs());
        assert_eq!(at(0, 50), None, "too early to say");
        assert_eq!(at(10, 0), None, "nothing is done yet");
        assert_eq!(at(10, 50), Some(10));
        assert_eq!(at(10, 100), Some(0));
        assert_eq!(at(10, 120), Some(0), "more than was expected");
        // A pause of a few seconds changes a long estimate by a step at most.
        assert_eq!([at(100, 10), at(103, 10)], [Some(900), Some(930)]);
        assert_eq!([clock(Duration::from_secs(75)), clock(Duration::from_secs(3675))], ["1:15", "1:01:15"]);
    }
}
