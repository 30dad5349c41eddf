//! `tercet simulate`.

use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, Result};
use clap::ValueEnum;
use serde_json::{Value, json};
use tercet::Limits;
use tercet::transport::simulation::{Channel, Run, Summary, ordered, session, summarize};
use tercet::transport::{Conditions, Goal, Objective, Settings, Source};

use crate::console::Console;
use crate::plot::{Plot, Point, Series};
use crate::table::Table;
use crate::{Outcome, channel, files};

#[derive(Debug, clap::Args)]
pub struct SimulateArgs {
    /// A .tct file; - for standard input.
    #[arg(value_name = "FILE.tct")]
    pub file: PathBuf,
    /// The channel, as words separated by commas: loss=P, burst=PACKETS, states=P/P (lost in the good
    /// and the bad state), rate=BITS (k, M), rtt=TIME, jitter=TIME (ms, s), ber=P, reorder=P,
    /// duplicate=P, phone=SEED (changing rates), trace=FILE.csv (seconds, bits per second and, if wanted, loss).
    #[arg(long, value_name = "WORDS", default_value = "loss=0.1,burst=8,rate=1M,rtt=100ms")]
    pub channel: String,
    /// What to compare.
    #[arg(long, value_delimiter = ',', default_value = "optimal,greedy,equal,none,arq")]
    pub strategy: Vec<Way>,
    /// Times at which viewers look, in seconds.
    #[arg(long, value_delimiter = ',', value_name = "SECONDS", value_parser = seconds, default_value = "0.2,0.3,0.5,0.7,1,1.5,2,3,5,7,10")]
    pub times: Vec<Duration>,
    /// For each time another session whose sender knows that it is the deadline.
    #[arg(long)]
    pub known: bool,
    /// What is to be best on average.
    #[arg(long, default_value = "psnr")]
    pub objective: Aim,
    /// Sessions of each strategy.
    #[arg(long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub runs: u32,
    /// The first session's seed; the others follow it.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Print JSON.
    #[arg(long)]
    pub json: bool,
    /// Draw the curves.
    #[arg(long, value_name = "OUT.svg")]
    pub plot: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Way {
    /// The best protection of each block.
    Optimal,
    /// Protection added packet by packet where it gains most.
    Greedy,
    /// The same protection of every block.
    Equal,
    /// No protection: what is missing is sent again.
    None,
    /// One ordered stream with congestion control, as TCP.
    Arq,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Aim {
    /// The peak signal-to-noise ratio.
    Psnr,
    /// The geometric error.
    Error,
}

impl Way {
    fn name(self) -> &'static str {
        match self {
            Way::Optimal => "optimal",
            Way::Greedy => "greedy",
            Way::Equal => "equal",
            Way::None => "none",
            Way::Arq => "arq",
        }
    }

    /// The strategy of a sender; none for the baseline, which knows no blocks.
    fn strategy(self) -> Option<tercet::transport::Strategy> {
        use tercet::transport::Strategy;
        match self {
            Way::Optimal => Some(Strategy::Optimal),
            Way::Greedy => Some(Strategy::Greedy),
            Way::Equal => Some(Strategy::Equal),
            Way::None => Some(Strategy::None),
            Way::Arq => None,
        }
    }
}

/// Sessions that have not ended by then are given up.
const PATIENCE: Duration = Duration::from_secs(300);

pub fn simulate(args: &SimulateArgs, limits: &Limits, console: &Console) -> Result<Outcome> {
    let channel = channel::parse(&args.channel).context("--channel")?;
    let name = files::name(&args.file);
    let source = Source::new(files::read_bytes(&args.file, limits)?).with_context(|| name.clone())?;
    let mut meter = console.meter();
    let mut summaries = Vec::new();
    for (i, &way) in args.strategy.iter().enumerate() {
        meter.show(way.name(), i as u64, args.strategy.len() as u64);
        summaries.push((way, summary(args, way, &source, &channel)?));
    }
    drop(meter);
    if let Some(path) = &args.plot {
        let title = format!("{name} over {}: mean of {} sessions, 5 to 95 %", args.channel, args.runs);
        files::write_bytes(plot(&summaries).file(&title).as_bytes(), path)?;
    }
    console.answer(&if args.json { format!("{:#}", as_json(&summaries)) } else { as_text(&summaries) })?;
    Ok(Outcome::Good)
}

/// The sessions of one strategy.
fn summary(args: &SimulateArgs, way: Way, source: &Source, channel: &Channel) -> Result<Summary> {
    let runs = |goal: Goal, end: Duration| -> Result<Vec<Run>> {
        let conditions = Conditions {
            loss: channel.estimate()?,
            rate: channel.steps[0].rate,
            round_trip: channel.round_trip,
        };
        let objective = match args.objective {
            Aim::Psnr => Objective::Psnr,
            Aim::Error => Objective::Error,
        };
        let seeds = (0..u64::from(args.runs)).map(|i| args.seed.wrapping_add(i));
        Ok(match way.strategy() {
            None => seeds.map(|seed| ordered(source, channel, seed, end)).collect(),
            Some(strategy) => {
                let settings = Settings { strategy, objective, goal, conditions };
                seeds.map(|seed| session(source, settings, channel, seed, end)).collect()
            }
        })
    };
    let whole = runs(Goal::Anytime, PATIENCE)?;
    let mut summary = summarize(&whole, &args.times, channel.round_trip, PATIENCE);
    if args.known && way != Way::Arq {
        for (point, &at) in summary.points.iter_mut().zip(&args.times) {
            let known = summarize(&runs(Goal::Deadline(at), at)?, &[at], channel.round_trip, at);
            *point = known.points[0];
        }
    }
    Ok(summary)
}

fn plot(summaries: &[(Way, Summary)]) -> Plot {
    let series = |(way, summary): &(Way, Summary)| {
        let points = summary.points.iter();
        let points = points.map(|p| Point { x: p.at.as_secs_f64(), y: p.psnr, band: Some([p.low, p.high]) });
        Series { name: way.name().into(), points: points.collect() }
    };
    Plot { x_label: "seconds", y_label: "PSNR in dB", series: summaries.iter().map(series).collect() }
}

fn as_text(summaries: &[(Way, Summary)]) -> String {
    let mut lines = String::from("Mean PSNR in dB, and bytes sent, by time:\n\n");
    let mut heads = vec!["time".to_string()];
    heads.extend(summaries.iter().flat_map(|(way, _)| [way.name().to_string(), "bytes".into()]));
    let mut table = Table::with_heads(heads);
    let times = summaries.first().map_or(0, |(_, summary)| summary.points.len());
    for i in 0..times {
        let mut cells = vec![format!("{} s", summaries[0].1.points[i].at.as_secs_f64())];
        for (_, summary) in summaries {
            let point = &summary.points[i];
            cells.extend([format!("{:.2}", point.psnr), format!("{:.0}", point.bytes)]);
        }
        table.wide_row(cells);
    }
    lines += &table.lines();
    let heads = ["strategy", "mesh in 1.5 round trips", "exact", "mean", "95 %", "bytes sent"];
    let mut table = Table::new(heads);
    for (way, summary) in summaries {
        table.row([
            way.name().into(),
            format!("{:.2} %", 100.0 * summary.base_in_time),
            format!("{:.1} %", 100.0 * summary.exact_share),
            format!("{:.3} s", summary.exact),
            format!("{:.3} s", summary.exact_high),
            format!("{:.0}", summary.bytes),
        ]);
    }
    lines + "\n\n" + &table.lines()
}

fn as_json(summaries: &[(Way, Summary)]) -> Value {
    let one = |(way, summary): &(Way, Summary)| {
        let points = summary.points.iter().map(|point| {
            json!({
                "seconds": point.at.as_secs_f64(),
                "psnr": point.psnr,
                "psnr_standard_error": point.psnr_error,
                "psnr_5_percent": point.low,
                "psnr_95_percent": point.high,
                "error": point.error,
                "bytes": point.bytes,
            })
        });
        json!({
            "strategy": way.name(),
            "points": points.collect::<Vec<_>>(),
            "base_in_time": summary.base_in_time,
            "exact_seconds": summary.exact,
            "exact_seconds_95_percent": summary.exact_high,
            "exact_share": summary.exact_share,
            "bytes": summary.bytes,
        })
    };
    Value::Array(summaries.iter().map(one).collect())
}

fn seconds(text: &str) -> Result<Duration, String> {
    match text.parse().map(Duration::try_from_secs_f64) {
        Ok(Ok(time)) if time > Duration::ZERO && time <= PATIENCE => Ok(time),
        _ => Err("a time is a number of seconds above 0, at most 300".into()),
    }
}
