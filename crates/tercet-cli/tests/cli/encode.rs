//! `tercet encode`.

use crate::Folder;
use tercet::shapes;

#[test]
fn the_table_has_a_row_for_every_level_and_the_total_is_the_file() {
    let folder = Folder::new("encode-table");
    folder.write_mesh("scan.ply", &shapes::scan(3000, 1));
    let text = folder.good("encode scan.ply -o out.tct --bits 12");
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next().unwrap().split_whitespace().collect();
    assert_eq!(heads, ["level", "kind", "vertices", "faces", "bytes", "cumulative", "bits/vertex", "error"]);
    let rows: Vec<Vec<&str>> = lines
        .map(|line| line.split_whitespace().collect())
        .take_while(|row: &Vec<&str>| row[0] != "total:")
        .collect();
    for (i, row) in rows.iter().enumerate().take_while(|(_, row)| row[0] != "restoration") {
        assert_eq!(row[0], i.to_string());
    }
    assert_eq!(rows[0][1], "base");
    let sizes = rows.iter().map(|row| row[row.iter().position(|c| c.parse::<f64>().is_err()).unwrap() + 3]);
    let sum: u64 = sizes.map(|bytes| bytes.parse::<u64>().unwrap()).sum();
    assert_eq!(sum, folder.read("out.tct").len() as u64);
    assert!(text.contains(&format!("\ntotal: {sum} bytes, ")), "{text}");
    assert!(text.contains("% of the 107952 bytes of its plain arrays"), "{text}");
}

#[test]
fn the_output_is_named_after_the_mesh_and_quiet_is_quiet() {
    let folder = Folder::new("encode-names");
    folder.write_mesh("ico.obj", &shapes::icosahedron());
    assert_eq!(folder.good("encode ico.obj --quiet"), "");
    assert!(folder.exists("ico.tct"));
}

#[test]
fn standard_input_and_output_carry_the_same_bytes_as_files() {
    let folder = Folder::new("encode-pipe");
    folder.write_mesh("torus.off", &shapes::torus(9, 6));
    folder.good("encode torus.off --bits 10");
    let run = folder.run_with("encode - --format off --bits 10", folder.read("torus.off"));
    assert_eq!(run.status, 0, "{}", run.err);
    assert_eq!(run.out, folder.read("torus.tct"));
    assert!(run.err.starts_with("level"), "the table is on standard error: {}", run.err);
}

#[test]
fn options_reach_the_file() {
    let folder = Folder::new("encode-options");
    folder.write_mesh("scan.ply", &shapes::scan(500, 2));
    folder.good("encode scan.ply --bits 9 --keep-order --update third");
    let info = folder.good("info scan.tct");
    assert!(info.contains("precision  9 bits"), "{info}");
    assert!(info.contains("order      kept\n"), "{info}");
    folder.good("encode scan.ply");
    let info = folder.good("info scan.tct");
    assert!(info.contains("precision  exact"), "{info}");
    assert!(info.contains("order      not kept"), "{info}");
}

#[test]
fn levels_in_groups_come_back_and_info_names_them() {
    let folder = Folder::new("encode-groups");
    let mesh = tercet::subdivide(&shapes::scan(100, 1), tercet::Scheme::Sqrt3, 4, &Default::default());
    folder.write_mesh("rough.ply", &shapes::noisy(&mesh.unwrap(), 0.002, 1));
    folder.good("encode rough.ply --bits 12 -o plain.tct");
    let table = folder.good("encode rough.ply --bits 12 --groups -o groups.tct");
    for name in ["plain", "groups"] {
        folder.good(&format!("decode {name}.tct -o {name}.ply"));
    }
    assert!(folder.read("groups.ply") == folder.read("plain.ply"));
    let named = |text: String| text.lines().filter(|line| line.contains("sqrt3 in groups")).count();
    let level = |level: &serde_json::Value| level["grouped"].as_bool().unwrap();
    let levels = |name: &str| -> Vec<bool> {
        let info: serde_json::Value =
            serde_json::from_str(&folder.good(&format!("info {name}.tct --json"))).unwrap();
        info["levels"].as_array().unwrap().iter().map(level).collect()
    };
    let grouped = levels("groups").into_iter().filter(|&grouped| grouped).count();
    assert!(grouped > 0 && !levels("plain").contains(&true));
    assert_eq!([named(table), named(folder.good("info groups.tct"))], [grouped; 2]);
    assert_eq!(named(folder.good("info plain.tct")), 0);
}

#[test]
fn errors_name_file_place_and_cause() {
    let folder = Folder::new("encode-errors");
    folder.write("nan.obj", "v 0 0 0\nv 1 nan 0\nv 0 1 0\nf 1 2 3\n");
    let mut binary = b"ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\n".to_vec();
    binary.extend(b"property float y\nproperty float z\nend_header\n");
    binary.extend([0.0, 0.0, 0.0, 1.0, f32::NAN, 0.0].iter().flat_map(|x| x.to_le_bytes()));
    folder.write("nan.ply", binary);
    folder.write("index.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
    folder.write("word.obj", "v 0 0 0\nv 1 zero 0\n");
    folder.write("mesh.glb", "glTF");
    for (arguments, parts) in [
        ("encode nan.obj", ["error: nan.obj: ", "line 2", "finite"]),
        ("encode nan.ply", ["error: nan.ply: ", "vertex 1", "finite"]),
        ("encode index.obj", ["error: index.obj: ", "line 4", "4"]),
        ("encode word.obj", ["error: word.obj: ", "line 2", "zero"]),
        ("encode mesh.glb", ["error: mesh.glb: ", "suffix", "--format"]),
        ("encode none.obj", ["error: none.obj: ", "No such file", ""]),
        ("encode -", ["error: -: ", "--format", "obj"]),
    ] {
        let message = folder.failed(arguments);
        for part in parts {
            assert!(message.contains(part), "{part:?} is not in {message:?}");
        }
    }
    for name in ["nan.tct", "index.tct", "word.tct", "none.tct"] {
        assert!(!folder.exists(name), "{name} was written");
    }
}

#[test]
fn what_is_not_carried_is_named_in_a_warning() {
    let folder = Folder::new("encode-warnings");
    folder.write("quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1 4//1\n");
    let run = folder.run("encode quad.obj");
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(run.err.lines().count() >= 2, "{}", run.err);
    assert!(run.err.lines().all(|line| line.starts_with("warning: quad.obj: ")), "{}", run.err);
    assert!(run.err.contains("polygon") && run.err.contains("normals"), "{}", run.err);
    assert_eq!(folder.run("encode quad.obj -q").err, "");
}

#[test]
fn a_mesh_beyond_the_memory_limit_is_refused() {
    let folder = Folder::new("encode-limit");
    folder.write_mesh("scan.ply", &shapes::scan(5000, 1));
    let message = folder.failed("encode scan.ply --max-memory 64K");
    assert!(message.contains("scan.ply") && message.contains("limit"), "{message}");
}

#[test]
fn lossy_files_keep_to_their_bounds_and_say_what_they_are() {
    let folder = Folder::new("encode-lossy");
    folder.write_mesh("scan.ply", &shapes::scan(2000, 1));
    let text = folder.good("encode scan.ply --max-error 0.002 -o near.tct");
    assert!(text.contains("distance from the mesh: RMS 0."), "{text}");
    let metrics: serde_json::Value =
        serde_json::from_str(&folder.good("metrics scan.ply near.tct --json")).unwrap();
    let rms = metrics["rms"].as_f64().unwrap() / metrics["diagonal"].as_f64().unwrap();
    assert!(rms <= 0.002, "{rms}");
    folder.good("encode scan.ply --max-bytes 1K -o small.tct");
    let info: serde_json::Value = serde_json::from_str(&folder.good("info small.tct --json")).unwrap();
    assert!(info["bytes"].as_u64().unwrap() <= 1024);
    assert_eq!(info["lossy"]["vertices"], 2000);
    assert!(folder.good("info small.tct").contains("lossy      RMS "));
    folder.good("encode scan.ply --bits 12 -o plain.tct");
    let plain: serde_json::Value = serde_json::from_str(&folder.good("info plain.tct --json")).unwrap();
    assert!(plain["lossy"].is_null());
}

#[test]
fn lossy_bounds_exclude_each_other_and_what_they_decide() {
    let folder = Folder::new("encode-lossy-refused");
    folder.write_mesh("scan.ply", &shapes::scan(300, 1));
    for other in ["--bits 12", "--keep-order", "--max-bytes 900"] {
        assert_eq!(folder.run(&format!("encode scan.ply --max-error 0.01 {other}")).status, 2, "{other}");
    }
    let message = folder.failed("encode scan.ply --max-bytes 50");
    assert!(message.contains("no lossy file of at most 50 bytes was found"), "{message}");
    assert!(!folder.exists("scan.tct"));
}
