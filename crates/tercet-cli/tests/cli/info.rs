//! `tercet info`.

use crate::Folder;
use serde_json::Value;
use tercet::shapes;

#[test]
fn json_holds_the_levels_with_cumulative_bytes() {
    let folder = Folder::new("info-json");
    folder.write_mesh("scan.ply", &shapes::scan(1500, 1));
    folder.good("encode scan.ply --bits 12");
    let info: Value = serde_json::from_str(&folder.good("info scan.tct --json")).unwrap();
    assert_eq!(info["version"], folder.read("scan.tct")[4], "the byte after the magic");
    assert_eq!((&info["vertices"], &info["faces"]), (&1500.into(), &2996.into()));
    assert_eq!(info["order_kept"], false);
    assert_eq!((&info["precision"]["kind"], &info["precision"]["bits"]), (&"lattice".into(), &12.into()));
    assert_eq!(info["bytes"], folder.read("scan.tct").len());
    let levels = info["levels"].as_array().unwrap();
    assert_eq!(levels[0]["kind"], "base");
    for (i, pair) in levels.windows(2).enumerate() {
        let number = |k: usize, field: &str| pair[k][field].as_f64().unwrap();
        assert_eq!(pair[0]["level"], i);
        assert!(number(0, "vertices") < number(1, "vertices"));
        assert!(number(0, "faces") < number(1, "faces"));
        assert!(number(0, "bytes") < number(1, "bytes"));
        assert!(number(0, "error") > number(1, "error"));
        assert!(["adaptive", "late"].map(Value::from).contains(&pair[1]["kind"]), "{}", pair[1]["kind"]);
    }
    let finest = levels.last().unwrap();
    assert_eq!((&finest["vertices"], &finest["faces"]), (&1500.into(), &2996.into()));
    assert!(finest["bytes"].as_u64() <= info["bytes"].as_u64());
}

#[test]
fn text_says_the_same_for_a_person() {
    let folder = Folder::new("info-text");
    folder.write(
        "pyramid.obj",
        "v 0 0 0\nv 0.5 0 0\nv 0 0.25 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
    );
    folder.good("encode pyramid.obj");
    let text = folder.good("info pyramid.tct");
    let lines: Vec<&str> = text.lines().collect();
    let version = format!("version    {}", folder.read("pyramid.tct")[4]);
    assert_eq!(
        lines[..6],
        [
            version.as_str(),
            "effort     default",
            "precision  exact: multiples of 10^-2",
            "order      not kept: vertices and faces are renumbered",
            "vertices   4",
            "faces      4",
        ]
    );
    assert!(lines[6].starts_with("level  kind"), "{text}");
    assert!(lines.last().unwrap().starts_with("total: "), "{text}");
}

#[test]
fn sqrt3_levels_are_named() {
    let folder = Folder::new("info-sqrt3");
    folder.write_mesh("ico.ply", &shapes::scan(60, 1));
    folder.good("subdivide ico.ply -o fine.ply --scheme sqrt3 --steps 2");
    folder.good("encode fine.ply --bits 12 --update third");
    let info: Value = serde_json::from_str(&folder.good("info fine.tct --json")).unwrap();
    let levels = info["levels"].as_array().unwrap();
    let kinds: Vec<&str> = levels.iter().rev().map(|level| level["kind"].as_str().unwrap()).collect();
    assert_eq!(kinds[..2], ["sqrt3"; 2]);
    assert_eq!(levels.last().unwrap()["update"], "third");
    assert!(folder.good("info fine.tct").contains("sqrt3, update third"));
}

#[test]
fn the_scheme_decides_which_levels_are_looked_for_and_the_table_names_them() {
    let folder = Folder::new("info-scheme");
    folder.write_mesh("ico.ply", &shapes::scan(200, 1));
    folder.good("subdivide ico.ply -o fine.ply --scheme butterfly --steps 2");
    for (scheme, kind) in
        [("auto", "butterfly"), ("butterfly", "butterfly"), ("sqrt3", "adaptive"), ("adaptive", "adaptive")]
    {
        let table = folder.good(&format!("encode fine.ply --bits 12 --scheme {scheme}"));
        let info: Value = serde_json::from_str(&folder.good("info fine.tct --json")).unwrap();
        let levels = info["levels"].as_array().unwrap();
        assert!(levels.iter().rev().take(2).all(|level| level["kind"] == kind), "{scheme}: {table}");
        assert!(table.contains(kind), "{scheme}: {table}");
        // Where the scheme does not fit, levels are adaptive; the file restores the mesh all the same.
        assert_eq!(levels[1]["kind"], "adaptive", "{scheme}: {table}");
        folder.good("verify fine.ply fine.tct --quiet");
    }
}

#[test]
fn the_beginning_of_a_file_is_enough() {
    let folder = Folder::new("info-beginning");
    folder.write_mesh("scan.ply", &shapes::scan(1500, 1));
    folder.good("encode scan.ply");
    let whole = folder.read("scan.tct");
    folder.write("cut.tct", &whole[..1024]);
    let run = folder.run("info cut.tct --json");
    assert_eq!((run.status, run.text()), (0, folder.good("info scan.tct --json")));
    assert_eq!(run.err, format!("warning: cut.tct: truncated after 1024 of {} bytes\n", whole.len()));
    let piped = folder.run_with("info - --json", whole);
    assert_eq!((piped.status, piped.out), (0, run.out));
    folder.write("head.tct", &folder.read("scan.tct")[..20]);
    assert!(folder.failed("info head.tct").starts_with("error: head.tct: header"));
}
