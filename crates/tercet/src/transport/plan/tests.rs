use super::*;
use crate::shapes::Random;
use crate::transport::GilbertElliott;
use std::time::Instant;

fn demand(lacking: u32, bytes: u32, gain: f64) -> Demand {
    Demand { lacking, pending: 0, bytes, gain, parts: None }
}

fn cost(demands: &[Demand], packets: &[u32]) -> u64 {
    demands.iter().zip(packets).map(|(demand, &n)| u64::from(n) * u64::from(demand.bytes)).sum()
}

/// The best value of every way to spend the budget, by trying them all.
fn exhaustive(demands: &[Demand], budget: u64, runs: &mut Runs) -> f64 {
    fn all(demands: &[Demand], taken: &mut Vec<u32>, budget: u64, runs: &mut Runs) -> f64 {
        let Some(demand) = demands.get(taken.len()) else { return expected(demands, taken, runs) };
        let mut best: f64 = 0.0;
        for packets in 0..=(budget / u64::from(demand.bytes)) as u32 {
            taken.push(packets);
            let left = budget - u64::from(packets) * u64::from(demand.bytes);
            best = best.max(all(demands, taken, left, runs));
            taken.pop();
        }
        best
    }
    all(demands, &mut Vec::new(), budget, runs)
}

#[test]
fn the_optimum_is_that_of_exhaustive_search() {
    let mut random = Random::new(1);
    let channels = [
        GilbertElliott::independent(0.05).unwrap(),
        GilbertElliott::independent(0.2).unwrap(),
        GilbertElliott::bursts(0.1, 8.0).unwrap(),
        GilbertElliott::bursts(0.2, 3.0).unwrap(),
    ];
    for case in 0..60 {
        let mut runs = Runs::new(channels[case % channels.len()]);
        let mut demands: Vec<Demand> = (0..3)
            .map(|_| {
                let bytes = 600 + 2 * random.below(290) as u32;
                demand(1 + random.below(3) as u32, bytes, 1.0 + 20.0 * random.unit())
            })
            .collect();
        demands[0].pending = random.below(2) as u32;
        let budget = 2000 + random.below(8000) as u64;
        let best = exhaustive(&demands, budget, &mut runs);
        let packets = plan(Strategy::Optimal, &demands, budget, &mut runs);
        assert!(cost(&demands, &packets) <= budget);
        let found = expected(&demands, &packets, &mut runs);
        assert!(found >= 0.98 * best, "case {case}: {found} of {best}, {packets:?} for {demands:?}");
    }
}

#[test]
fn no_strategy_beats_the_optimum_or_the_budget() {
    let mut random = Random::new(2);
    for case in 0..40 {
        let mut runs = Runs::new(GilbertElliott::bursts(0.1, 1.2 + 8.0 * random.unit()).unwrap());
        let levels = 2 + random.below(8);
        let demands: Vec<Demand> =
            (0..levels).map(|level| demand(1 << level.min(5), 1178, 1.0 + 10.0 * random.unit())).collect();
        let budget = 1178 * (1 + random.below(150) as u64);
        let mut value = |strategy| {
            let packets = plan(strategy, &demands, budget, &mut runs);
            assert!(cost(&demands, &packets) <= budget, "{strategy:?}");
            expected(&demands, &packets, &mut runs)
        };
        let best = value(Strategy::Optimal);
        for strategy in [Strategy::None, Strategy::Equal, Strategy::Greedy] {
            // All that is certain to a millionth is left as it is.
            assert!(best >= value(strategy) * (1.0 - 1e-4), "case {case}: {strategy:?}");
        }
    }
}

/// Coarse levels gate all others, so that they deserve the most.
#[test]
fn protection_falls_from_level_to_level() {
    let mut runs = Runs::new(GilbertElliott::independent(0.1).unwrap());
    let demands = [demand(1, 1178, 30.0), demand(1, 1178, 6.0), demand(1, 1178, 6.0), demand(1, 1178, 6.0)];
    let packets = plan(Strategy::Optimal, &demands, 1178 * 7, &mut runs);
    assert!(packets.is_sorted_by(|a, b| a >= b) && packets[0] > packets[3], "{packets:?}");
}

#[test]
fn nothing_to_send_and_nothing_to_spend_are_plans() {
    let mut runs = Runs::new(GilbertElliott::independent(0.1).unwrap());
    for strategy in [Strategy::None, Strategy::Equal, Strategy::Greedy, Strategy::Optimal] {
        assert_eq!(plan(strategy, &[], 1000, &mut runs), Vec::<u32>::new());
        assert_eq!(plan(strategy, &[demand(2, 1178, 1.0)], 1178, &mut runs), [0]);
    }
}

/// Twenty levels, doubling every third, over a bursty channel, with a budget that allows no redundancy.
fn twenty_levels() -> (Vec<Demand>, u64) {
    let demands: Vec<Demand> = (0..20).map(|level| demand(1 << (level / 3u32).min(7), 1178, 5.0)).collect();
    let budget = cost(&demands, &demands.iter().map(|demand| demand.lacking).collect::<Vec<_>>());
    (demands, budget)
}

#[test]
fn a_budget_without_end_affords_any_block() {
    let parts = Some(Parts { symbols: 4, gains: [0.0; STEPS + 1] });
    let mut runs = Runs::new(GilbertElliott::bursts(0.1, 2.0).unwrap());
    let choices = choices(&Demand { parts, ..demand(4, 1, 5.0) }, u64::MAX, false, &mut runs);
    assert!(choices.last().unwrap().chance > 0.99);
}

/// The bound is 20 ms. A step of the plan is two additions, a multiplication and a comparison, a step of a
/// table some twenty operations: less than 1 and 10 ns. Steps are counted, because tests run on busy machines.
#[test]
fn twenty_levels_are_planned_in_few_steps() {
    let (demands, budget) = twenty_levels();
    for burst in [1.0 / 0.9, 8.0] {
        let mut runs = Runs::new(GilbertElliott::bursts(0.1, burst).unwrap());
        let choices = affordable_choices(&demands, budget, &mut runs);
        let (units, costs) = in_units(&demands, budget);
        let of_choice =
            |choice: &Choice, cost: usize| (units + 1).saturating_sub(choice.packets as usize * cost);
        let of_block = |(choices, &cost): (&Vec<Choice>, &usize)| -> usize {
            choices.iter().map(|choice| of_choice(choice, cost)).sum()
        };
        let steps: usize = choices.iter().zip(&costs).map(of_block).sum();
        assert!((1..8_000_000).contains(&steps), "{steps}");
        // Both tables, each as long as the longest run that was asked for.
        let longest = (budget / 1178) as usize;
        assert!(longest * longest < 1_000_000, "{longest}");
        println!("burst {burst}: {steps} steps");
    }
}

/// What that takes: `cargo test --release --features transport plan_takes -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn plan_takes() {
    let (demands, budget) = twenty_levels();
    let times = (0..40).map(|_| {
        let start = Instant::now();
        let mut runs = Runs::new(GilbertElliott::bursts(0.1, 8.0).unwrap());
        assert!(plan(Strategy::Optimal, &demands, budget, &mut runs)[0] > 1);
        start.elapsed()
    });
    let mut times: Vec<_> = times.collect();
    times.sort();
    println!("best {:?}, median {:?}", times[0], times[20]);
}
