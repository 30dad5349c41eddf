use tercet::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let m = io::read(
        &std::fs::read(&a[1]).unwrap(),
        io::Format::from_path(a[1].as_ref()).unwrap(),
        &Limits::default(),
    )
    .unwrap()
    .mesh;
    let mut o = Vec::new();
    io::write(&m, io::Format::Ply, &mut o).unwrap();
    std::fs::write(&a[2], o).unwrap();
}
