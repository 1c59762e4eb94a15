//! Places for pedar's insoles, from a table beside the recording.

use somatic::source::{VendorFormat, VendorOptions, VendorSource};
use somatic::{Body, Calibration, Engine, Options, Outputs, Scene};

use crate::make::{self, Dialect, PLAIN};
use crate::{file, read_bytes};

const KPA: Dialect = Dialect { unit: "kPa", ..PLAIN };

/// Five sensors in a row, 10 mm apart, of 1 cm².
const ROW: &str = "id,x,y,area\n1,0.01,0,1e-4\n2,0.02,0,1e-4\n3,0.03,0,1e-4\n4,0.04,0.005,1e-4\n5,0.05,0,1e-4\n";

fn recording() -> String {
    make::novel(&KPA, &[5, 5], None, &[1, 2, 3])
}

fn with(table: &str) -> (tempfile::TempDir, VendorOptions) {
    let (folder, path) = file("insole.csv", table.as_bytes());
    (folder, VendorOptions { layout: Some(path), ..VendorOptions::default() })
}

#[test]
fn a_table_gives_force_and_centre_of_pressure() {
    let (_folder, options) = with(ROW);
    let (_other, path) = file("walk.asc", recording().as_bytes());
    let mut source = VendorSource::open(&path, &options).unwrap();
    assert_eq!((source.format(), source.layout().is_placed()), (VendorFormat::Pedar, true));
    let body = Body::from_bytes(&source.body_name(), &source.body().unwrap()).unwrap();
    let all = read_bytes("walk.asc", recording().as_bytes(), &options).unwrap();
    let calibration = Calibration::parse(&source.calibration().unwrap(), &all.ids).unwrap();
    let scene = Scene::default().outputs(Outputs::FORCE | Outputs::CENTROID | Outputs::POSITION);
    let mut engine = Engine::new(&body, Options::default().scene(scene).calibration(Some(calibration))).unwrap();
    engine.set_channels(&all.ids).unwrap();
    let mut frame = somatic::Frame::missing(0.0, all.ids.len());
    assert!(somatic::source::Source::next_frame(&mut source, &mut frame).unwrap());
    let percepts = engine.process_one(&frame).unwrap();
    let pressures: Vec<f64> = all.frames[0].1.iter().map(|value| value.number().unwrap()).collect();
    for (side, mirror, first) in [("left", 1.0, 0), ("right", -1.0, 5)] {
        let own = &pressures[first..first + 5];
        let sum: f64 = own.iter().sum();
        let percept = percepts.frame(0).find(|percept| percepts.field_name(percept.field) == side).unwrap();
        let newton = sum * 1000.0 * 1e-4;
        assert!((percept.force.unwrap() - newton).abs() < 1e-4 * newton, "{side}: {percept:?}");
        // The link's x is the page's.
        let x = own.iter().zip(1..).map(|(p, number)| p * 0.01 * f64::from(number)).sum::<f64>() / sum * mirror;
        let y = own[3] * 0.005 / sum;
        let position = percept.position.unwrap();
        assert!((position[0] - x).abs() < 1e-6 && (position[2] + y).abs() < 1e-6, "{side}: {position:?}, {x}, {y}");
    }
    // Without the table there are neither.
    let bare = VendorSource::open(&path, &VendorOptions::default()).unwrap();
    assert!(!bare.layout().is_placed());
}

#[test]
fn each_insole_may_have_places_of_its_own() {
    let rows = |side: &str, shift: f64| {
        (1..=5).map(|id| format!("{id},{},0,,{side}\n", shift + 0.01 * f64::from(id))).collect::<String>()
    };
    let (_folder, options) = with(&format!("id,x,y,area,link\n{}{}", rows("left", 0.0), rows("right", 0.1)));
    let all = read_bytes("walk.asc", recording().as_bytes(), &options).unwrap();
    let x = |panel: usize| all.layout.panels[panel].cells[0].centre_m[0];
    assert!((x(0) - 0.01).abs() < 1e-12 && (x(1) - 0.11).abs() < 1e-12);
    assert!(all.layout.panels.iter().flat_map(|panel| &panel.cells).all(|cell| cell.area_m2 == 0.0));
    let ids: Vec<u32> = (1..=10).collect();
    assert_eq!(all.ids, ids, "ids are as without places");
}

#[test]
fn a_table_that_does_not_fit_is_refused() {
    let why = |table: &str| {
        let (_folder, options) = with(table);
        read_bytes("walk.asc", recording().as_bytes(), &options).unwrap_err().to_string()
    };
    let short = why("id,x,y\n1,0,0\n2,0,0\n");
    assert!(
        short.contains("insole.csv: it has no row for sensor 3 of panel `left`") && !short.contains('\n'),
        "{short}"
    );
    assert!(why("id,x\n1,0\n").contains("no column `y`"));
    assert!(why("id,x,y\n1,0,0\n1,0,0\n").contains("line 3: id 1 is on line 2 already"));
    let (_folder, options) = with(ROW);
    let other = make::tekscan(&KPA, [6, 10], &[1]);
    assert!(read_bytes("a.asf", other.as_bytes(), &options).unwrap_err().to_string().contains("--layout is for pedar"));
}
