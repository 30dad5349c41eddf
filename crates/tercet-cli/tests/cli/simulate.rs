//! `tercet simulate`.

use crate::Folder;
use serde_json::Value;
use tercet::shapes;

fn folder(test: &str) -> Folder {
    let folder = Folder::new(test);
    folder.write_mesh("scan.ply", &shapes::scan(3000, 1));
    folder.good("encode scan.ply --bits 12");
    folder
}

#[test]
fn strategies_are_compared_in_a_table_a_picture_and_json() {
    let folder = folder("simulate");
    let words = "simulate scan.tct --runs 20 --times 0.2,1,5";
    let text = folder.good(&format!("{words} --plot curves.svg"));
    for name in ["optimal", "greedy", "equal", "none", "arq"] {
        assert!(text.contains(name), "{text}");
    }
    let picture = String::from_utf8(folder.read("curves.svg")).unwrap();
    assert!(picture.starts_with("<svg") && picture.ends_with("</svg>\n") && !picture.contains("NaN"));

    let json = folder.good(&format!("{words} --known --json --strategy optimal,arq"));
    assert_eq!(json, folder.good(&format!("{words} --known --json --strategy optimal,arq")), "it is seeded");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&json[0]["strategy"], &json[1]["strategy"]), (&"optimal".into(), &"arq".into()));
    assert_eq!(json[0]["points"].as_array().unwrap().len(), 3);
    assert_eq!(json[0]["exact_share"], 1.0);
}

#[test]
fn a_recorded_channel_is_read() {
    let folder = folder("simulate-trace");
    folder.write("drive.csv", "seconds,bits,loss\n0,1000000,0\n0.1,200000,0.3\n1,1000000,0.01\n");
    let trace = folder.path("drive.csv");
    let words = "--runs 5 --strategy optimal --times 5 --channel rtt=50ms,trace=";
    folder.good(&format!("simulate scan.tct {words}{}", trace.display()));
    folder.write("drive.csv", "0,fast\n");
    let message = folder.failed(&format!("simulate scan.tct {words}{}", trace.display()));
    assert!(message.contains("line 1"), "{message}");
}

#[test]
fn wrong_channels_and_files_are_told() {
    let folder = folder("simulate-wrong");
    assert!(folder.failed("simulate scan.tct --channel loss=2").contains("--channel"));
    assert!(folder.failed("simulate scan.ply").contains("magic"));
    assert_eq!(folder.run("simulate scan.tct --times 0").status, 2);
    assert_eq!(folder.run("simulate scan.tct --strategy best").status, 2);
}
