fn main() {
    let b = std::fs::read(std::env::args().nth(1).unwrap()).unwrap();
    let n: usize = std::env::args().nth(2).map_or(1, |n| n.parse().unwrap());
    let mut best = f64::MAX;
    let mut v = 0;
    for _ in 0..n {
        let t = std::time::Instant::now();
        v = tercet::decode(&b, &tercet::Limits::default()).unwrap().positions.len();
        best = best.min(t.elapsed().as_secs_f64());
    }
    println!("{v} vertices, best {:.3} Mv/s", v as f64 / best / 1e6);
}
