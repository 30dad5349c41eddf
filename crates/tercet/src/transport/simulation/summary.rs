//! Many runs as a few numbers.

use std::time::Duration;

use super::Run;

/// What viewers see at one time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// The time since the session began.
    pub at: Duration,
    /// The mean of the peak signal-to-noise ratio, in decibels.
    pub psnr: f64,
    /// Its standard error.
    pub psnr_error: f64,
    /// What nineteen of twenty viewers see at least.
    pub low: f64,
    /// What one of twenty viewers sees at least.
    pub high: f64,
    /// The mean of the geometric error, a part of the diagonal.
    pub error: f64,
    /// The mean of bytes sent by then.
    pub bytes: f64,
}

/// What many sessions of one kind came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// For each time that was asked for.
    pub points: Vec<Point>,
    /// The part of sessions that had a mesh within a round trip and a half: before any report could help.
    pub base_in_time: f64,
    /// Seconds until the original was there: the mean; sessions that ended before count as their end.
    pub exact: f64,
    /// The same that nineteen of twenty sessions needed at most.
    pub exact_high: f64,
    /// The part of sessions in which it was there at all.
    pub exact_share: f64,
    /// The mean of all bytes sent.
    pub bytes: f64,
}

/// Sums up runs that went on for `end` at most, over a channel of this round trip, at some times.
/// Takes time O(n log n) in the runs. No runs give zeros.
pub fn summarize(runs: &[Run], times: &[Duration], round_trip: Duration, end: Duration) -> Summary {
    let first = round_trip.mul_f64(1.5);
    let share = |of: &dyn Fn(&Run) -> bool| mean(runs.iter().map(|run| f64::from(u8::from(of(run)))));
    let mut exact: Vec<f64> = runs.iter().map(|run| run.exact().unwrap_or(end).as_secs_f64()).collect();
    exact.sort_by(f64::total_cmp);
    Summary {
        points: times.iter().map(|&at| point(runs, at)).collect(),
        base_in_time: share(&|run| run.base().is_some_and(|at| at <= first)),
        exact: mean(exact.iter().copied()),
        exact_high: quantile(&exact, 0.95),
        exact_share: share(&|run| run.exact().is_some()),
        bytes: mean(runs.iter().map(|run| run.bytes(end) as f64)),
    }
}

fn point(runs: &[Run], at: Duration) -> Point {
    let mut psnr: Vec<f64> = runs.iter().map(|run| run.quality(at).psnr()).collect();
    psnr.sort_by(f64::total_cmp);
    let average = mean(psnr.iter().copied());
    let variance = mean(psnr.iter().map(|x| (x - average) * (x - average)));
    Point {
        at,
        psnr: average,
        psnr_error: (variance / runs.len().max(1) as f64).sqrt(),
        low: quantile(&psnr, 0.05),
        high: quantile(&psnr, 0.95),
        error: mean(runs.iter().map(|run| run.quality(at).error())),
        bytes: mean(runs.iter().map(|run| run.bytes(at) as f64)),
    }
}

fn mean(numbers: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = numbers.fold((0u32, 0.0), |(count, sum), x| (count + 1, sum + x));
    sum / f64::from(count.max(1))
}

/// The number below which a part of sorted numbers lies.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let last = sorted.len().saturating_sub(1);
    sorted.get((part * last as f64).round() as usize).copied().unwrap_or(0.0)
}
