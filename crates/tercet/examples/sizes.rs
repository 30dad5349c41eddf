use std::time::Instant;
use tercet::*;
fn main() {
    let mut args = std::env::args().skip(1);
    let bits: u8 = args.next().unwrap().parse().unwrap();
    let draco: std::collections::HashMap<String, f64> = std::fs::read_to_string("/tmp/draco.txt")
        .unwrap_or_default()
        .lines()
        .filter_map(|l| {
            let mut w = l.split_whitespace();
            let n = w.next()?;
            let b: u8 = w.next()?.parse().ok()?;
            let v = w.next()?.parse().ok()?;
            (b == bits).then(|| (n.to_string(), v))
        })
        .collect();
    let (mut prod, mut count) = (0.0, 0);
    for path in args {
        let bytes = std::fs::read(&path).unwrap();
        let f = io::Format::from_path(path.as_ref()).unwrap();
        let mesh = io::read(&bytes, f, &Limits::default()).unwrap().mesh;
        let t = Instant::now();
        let e =
            encode(&mesh, &EncodeOptions { bits: (bits > 0).then_some(bits), ..Default::default() }).unwrap();
        std::fs::write("/tmp/out.tct", &e.bytes).unwrap();
        let te = t.elapsed().as_secs_f64();
        let t = Instant::now();
        let mut d = Decoder::new(Limits::default());
        d.push(&e.bytes);
        let mut n = 0;
        while let Some(_) = d.next_level().unwrap() {
            n += 1;
        }
        let td = t.elapsed().as_secs_f64();
        let v = mesh.positions.len() as f64;
        let name = std::path::Path::new(&path).file_name().unwrap().to_str().unwrap().to_string();
        let r = draco.get(&name).map_or(0.0, |d| e.bytes.len() as f64 / d);
        if r > 0.0 {
            prod += r.ln();
            count += 1;
        }
        println!(
            "{name:22} {:8} v  {:8} B {:6.2} bpv  conn {:5.2} pos {:6.2}  levels {n:2} base {:5} ratio {r:.4}  enc {:.2} Mv/s dec {:.2} Mv/s",
            v,
            e.bytes.len(),
            e.bytes.len() as f64 * 8.0 / v,
            e.connectivity_bits as f64 / v,
            e.position_bits as f64 / v,
            e.info.levels[0].vertices,
            v / te / 1e6,
            v / td / 1e6
        );
    }
    println!("geomean {:.4} over {count}", (prod / count as f64).exp());
}
