//! The same recording as other machines would write it, and other recordings in the same formats.

use somatic::internal::signal::UnitOfP;
use somatic::source::{VendorFormat, VendorOptions};
use somatic::{Error, RawValue};

use crate::make::{self, Dialect, PLAIN, value};
use crate::{Read, read_bytes};

const FEET: [&str; 2] = ["HX210.11.31.M11-DFM-LF S0073", "HX210.11.31.M11-DFM-RF S0073"];

fn plainly(name: &str, text: &str) -> Result<Read, Error> {
    read_bytes(name, text.as_bytes(), &VendorOptions::default())
}

/// A text in every encoding that such files come in.
fn encoded(text: &str) -> Vec<(&'static str, Vec<u8>)> {
    let utf_16 = |bytes: fn(u16) -> [u8; 2]| -> Vec<u8> { text.encode_utf16().flat_map(bytes).collect() };
    let with = |mark: &[u8], bytes: Vec<u8>| [mark, &bytes[..]].concat();
    vec![
        ("UTF-8", text.as_bytes().to_vec()),
        ("UTF-8 with a mark", with(b"\xEF\xBB\xBF", text.as_bytes().to_vec())),
        ("UTF-16, little end first", with(b"\xFF\xFE", utf_16(u16::to_le_bytes))),
        ("UTF-16, big end first", with(b"\xFE\xFF", utf_16(u16::to_be_bytes))),
        ("UTF-16 without a mark", utf_16(u16::to_le_bytes)),
        ("Latin-1", text.chars().map(|c| c as u8).collect()),
    ]
}

/// `write` in every dialect and encoding that says the same as `write(&PLAIN)`.
fn the_same_in_every_dialect(name: &str, separators: &[&'static str], write: impl Fn(&Dialect) -> String) -> Read {
    let right = plainly(name, &write(&PLAIN)).unwrap();
    let mut variants = 0;
    for &separator in separators {
        for decimal in [".", ","] {
            if separator == decimal {
                continue;
            }
            for newline in ["\n", "\r\n"] {
                let text = write(&Dialect { separator, decimal, newline, ..PLAIN });
                for (encoding, bytes) in encoded(&text) {
                    let got = read_bytes(name, &bytes, &VendorOptions::default());
                    let got = got.unwrap_or_else(|e| panic!("{separator:?} {decimal:?} {newline:?} {encoding}: {e}"));
                    assert_eq!(got, right, "{separator:?} {decimal:?} {newline:?} {encoding}");
                    variants += 1;
                }
            }
        }
    }
    assert!(variants >= 24);
    right
}

fn numbers(values: &[RawValue]) -> Vec<Option<f64>> {
    values.iter().map(|value| value.number().map(|value| f64::from(value as f32))).collect()
}

/// Values that are all there.
fn singles(values: &[RawValue]) -> Vec<f32> {
    values.iter().map(|value| value.number().unwrap() as f32).collect()
}

/// The values of `frame` of a grid, as single precision holds them.
fn grid(frame: usize, sensor: usize, [rows, columns]: [usize; 2]) -> Vec<Option<f64>> {
    let at = |cell: usize| value(frame, sensor, cell / columns, cell % columns);
    (0..rows * columns).map(|cell| Some(f64::from(at(cell) as f32))).collect()
}

#[test]
fn xsensor_is_read_in_every_dialect() {
    let sizes = [7, 5];
    let all = the_same_in_every_dialect("a.csv", &[",", ";", "\t"], |dialect| {
        make::xsensor(dialect, &FEET, sizes, &[1464, 1465, 1468])
    });
    assert_eq!((all.format, all.layout.unit.symbol()), (VendorFormat::Xsensor, "mmHg"));
    // Frames that are missing leave a gap.
    let times: Vec<f64> = all.frames.iter().map(|(t_s, _)| *t_s).collect();
    assert_eq!(times, [0.0, 0.013, 0.052]);
    for ((_, values), frame) in all.frames.iter().zip([1464, 1465, 1468]) {
        assert_eq!(numbers(values), [grid(frame, 0, sizes), grid(frame, 1, sizes)].concat());
    }
    let names: Vec<&str> = all.layout.panels.iter().map(|panel| panel.name.as_str()).collect();
    assert_eq!(names, ["left", "right"]);
    // The area of all cells over their number, which the groups tell.
    let area = all.layout.panels[0].cells[0].area_m2;
    assert!((area - 23.72e-4 / 32.0).abs() < 1e-12, "{area}");
}

#[test]
fn xsensor_is_read_in_other_units_of_one_foot_and_without_what_may_be_left_out() {
    for (unit, pascal) in [("psi", 6_894.757_293_168), ("N/cm²", 1e4), ("kPa", 1e3), ("mmHg", 133.322_387_415)] {
        let text = make::xsensor(&Dialect { unit, ..PLAIN }, &FEET[1..], [4, 3], &[1, 2]);
        let all = plainly("a.csv", &text).unwrap();
        assert_eq!((all.layout.unit.factor, all.layout.panels[0].name.as_str()), (pascal, "right"));
        assert_eq!(numbers(&all.frames[1].1), grid(2, 0, [4, 3]));
    }
    let bare = make::xsensor(&Dialect { bare: true, ..PLAIN }, &["mat"], [9, 20], &[1, 2, 3]);
    let all = plainly("a.csv", &bare).unwrap();
    assert_eq!((all.frames.len(), all.ids.len(), all.layout.panels[0].name.as_str()), (3, 180, "sensor"));
    // Without the area of the whole, width times height.
    assert!((all.layout.panels[0].cells[0].area_m2 - 0.86e-2 * 0.86e-2).abs() < 1e-15);
    // Without times, a rate; with them, none.
    let untimed: String =
        bare.lines().filter(|line| !line.starts_with("Time")).map(|line| format!("{line}\n")).collect();
    assert!(plainly("a.csv", &untimed).unwrap_err().to_string().contains("--rate HZ"));
    let rated = VendorOptions { rate_hz: Some(50.0), ..VendorOptions::default() };
    let all = read_bytes("a.csv", untimed.as_bytes(), &rated).unwrap();
    assert_eq!(all.frames.iter().map(|(t_s, _)| *t_s).collect::<Vec<_>>(), [0.0, 0.02, 0.04]);
    assert!(read_bytes("a.csv", bare.as_bytes(), &rated).unwrap_err().is_usage());
}

#[test]
fn a_foot_that_is_missing_in_a_frame_is_missing_values() {
    let (whole, one) = (make::xsensor(&PLAIN, &FEET, [4, 3], &[1]), make::xsensor(&PLAIN, &FEET[1..], [4, 3], &[2]));
    let second = one.split_once("FRAME").unwrap().1;
    let all = plainly("a.csv", &format!("{whole}FRAME{second}")).unwrap();
    assert_eq!(all.frames.len(), 2);
    assert!(all.frames[1].1[..12].iter().all(|value| value.is_missing()));
    assert_eq!(numbers(&all.frames[1].1[12..]), grid(2, 0, [4, 3]));
}

#[test]
fn tekscan_is_read_in_every_dialect() {
    let sizes = [6, 10];
    let all = the_same_in_every_dialect("a.asf", &[",", ";", "\t"], |dialect| {
        make::tekscan(&Dialect { unit: "raw", ..*dialect }, sizes, &[1, 2, 5])
    });
    assert_eq!((all.format, all.layout.unit), (VendorFormat::Tekscan, UnitOfP::COUNT));
    assert_eq!(all.frames.iter().map(|(t_s, _)| *t_s).collect::<Vec<_>>(), [0.0, 0.1, 0.4]);
    let panels: Vec<(&str, usize)> = all.layout.panels.iter().map(|p| (p.name.as_str(), p.cells.len())).collect();
    assert_eq!(panels, [("panel_1", 12), ("panel_2", 12)]);
    for ((_, values), frame) in all.frames.iter().zip([1, 2, 5]) {
        let right = all.ids.iter().map(|&id| Some(value(frame, 0, id as usize / 10, id as usize % 10).round()));
        assert_eq!(numbers(values), right.collect::<Vec<_>>());
    }
    // Ids are places on the map, and the panels lie apart as they do there.
    assert_eq!((all.ids[0], all.ids[1]), (11, 12));
    let [left, right] = [0, 1].map(|panel| all.layout.panels[panel].offset_m[0]);
    assert!((right - left - 5.0 * 0.00127).abs() < 1e-12);
}

#[test]
fn tekscan_has_newtons_only_where_it_is_calibrated() {
    for (unit, factor) in [("kPa", 1e3), ("KPA", 1e3), ("PSI", 6_894.757_293_168), ("raw", 1.0)] {
        let all = plainly("a.asf", &make::tekscan(&Dialect { unit, bare: true, ..PLAIN }, [5, 10], &[1, 2])).unwrap();
        assert_eq!(all.layout.unit.factor, factor);
        assert!((all.layout.panels[0].cells[0].area_m2 - 0.00127 * 0.00127).abs() < 1e-15);
    }
    let text = make::tekscan(&Dialect { unit: "furlongs", ..PLAIN }, [5, 10], &[1]);
    assert!(plainly("a.asf", &text).unwrap_err().to_string().contains("no unit `furlongs`"));
}

#[test]
fn emed_is_read_in_every_dialect_and_its_unit_follows_from_its_forces() {
    let sizes = [8, 5];
    let all = the_same_in_every_dialect("a.lst", &["\t"], |dialect| make::emed(dialect, sizes, &[1, 2, 4], 1.0));
    assert_eq!((all.format, all.layout.unit.symbol()), (VendorFormat::Emed, "kPa"));
    assert_eq!(all.frames.iter().map(|(t_s, _)| *t_s).collect::<Vec<_>>(), [0.0, 0.01, 0.03]);
    assert_eq!(all.ids[0], 29 * 64 + 25);
    let right: Vec<Option<f64>> = grid(4, 0, sizes).into_iter().map(|value| value.map(f64::round)).collect();
    assert_eq!(numbers(&all.frames[2].1), right);
    for (kpa, unit) in [(1.0, "kPa"), (10.0, "N/cm2"), (6.894757, "psi")] {
        let all = plainly("a.lst", &make::emed(&Dialect { bare: true, ..PLAIN }, sizes, &[1, 2], kpa)).unwrap();
        assert_eq!(all.layout.unit.symbol(), unit);
    }
}

#[test]
fn novel_is_read_in_every_dialect_with_one_foot_or_two_with_places_or_without() {
    let kpa = |dialect: &Dialect| Dialect { unit: "kPa", ..*dialect };
    let all =
        the_same_in_every_dialect("a.asc", &["\t"], |dialect| make::novel(&kpa(dialect), &[6, 6], None, &[1, 2, 9]));
    assert_eq!((all.format, all.layout.panels.len(), all.layout.is_placed()), (VendorFormat::Pedar, 2, false));
    assert_eq!(all.ids, (1..=12).collect::<Vec<u32>>());
    assert_eq!(all.frames[2].0, 0.09);
    let right: Vec<Option<f64>> = (0..12).map(|cell| Some(f64::from(value(9, 0, 0, cell) as f32))).collect();
    assert_eq!(numbers(&all.frames[2].1), right);
    let one = plainly("a.asc", &make::novel(&Dialect { unit: "N/cm²", ..PLAIN }, &[99], None, &[1])).unwrap();
    assert_eq!((one.layout.panels[0].name.as_str(), one.layout.unit.factor), ("left", 1e4));

    let all =
        the_same_in_every_dialect("a.asc", &["\t"], |dialect| make::novel(&kpa(dialect), &[12], Some(4), &[1, 2]));
    assert_eq!((all.format, all.layout.is_placed()), (VendorFormat::Pliance, true));
    let cell = all.layout.panels[0].cells[5];
    assert_eq!(cell.id, 6);
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
    assert!(near(cell.centre_m[0], 0.015) && near(cell.centre_m[1], 0.17) && near(cell.area_m2, 2e-4), "{cell:?}");
    // Without what may be left out, places among it, it is only numbers.
    let bare = make::novel(&Dialect { bare: true, unit: "kPa", ..PLAIN }, &[12], Some(4), &[1, 2]);
    assert!(plainly("a.asc", &bare).unwrap().layout.is_placed());
    let unplaced = bare.split_once("sensor ").unwrap().0;
    let all = plainly("a.asc", unplaced).unwrap();
    assert!(!all.layout.is_placed() && all.frames.len() == 2 && all.losses.is_empty());
}

#[test]
fn plain_matrices_are_read_by_line_and_by_block() {
    let options = VendorOptions {
        grid: Some([3, 4]),
        pitch_m: Some([0.01, 0.02]),
        rate_hz: Some(10.0),
        unit: Some(UnitOfP::KILOPASCAL),
        ..VendorOptions::default()
    };
    let cells = |frame: usize, dialect: &Dialect| -> Vec<String> {
        (0..12).map(|cell| dialect.number(value(frame, 0, cell / 4, cell % 4), 2)).collect()
    };
    for (separator, decimal) in [(",", "."), (";", ","), ("\t", ","), (" ", ".")] {
        let dialect = Dialect { separator, decimal, ..PLAIN };
        let lines: String = (0..3).map(|frame| dialect.row(&cells(frame, &dialect)) + "\n").collect();
        let block = |frame: usize| -> String {
            cells(frame, &dialect).chunks(4).map(|row| dialect.row(row) + "\n").collect::<String>()
        };
        let blocks: String = (0..3).map(|frame| block(frame) + "\n").collect();
        let named: String = (0..3).map(|frame| format!("Frame {frame}\n{}", block(frame))).collect();
        for text in [&lines, &blocks, &named, &lines.replace('\n', "\r\n"), &blocks.replace('\n', "\r\n")] {
            let all = read_bytes("a.txt", text.as_bytes(), &options).unwrap_or_else(|e| panic!("{e}: {text}"));
            assert_eq!(all.frames.len(), 3, "{text}");
            for (frame, (t_s, values)) in all.frames.iter().enumerate() {
                assert_eq!((*t_s, numbers(values)), (frame as f64 / 10.0, grid(frame, 0, [3, 4])));
            }
            let cell = all.layout.panels[0].cells[0];
            assert!((cell.area_m2 - 2e-4).abs() < 1e-15 && (cell.centre_m[0] + 0.03).abs() < 1e-15, "{cell:?}");
        }
        let timed: String = (0..3)
            .map(|frame| {
                format!(
                    "{}{separator}{}\n",
                    dialect.number(0.5 * frame as f64, 2),
                    dialect.row(&cells(frame, &dialect))
                )
            })
            .collect();
        let own = VendorOptions { rate_hz: None, ..options.clone() };
        assert_eq!(read_bytes("a.txt", timed.as_bytes(), &own).unwrap().frames[2].0, 1.0);
        assert!(read_bytes("a.txt", timed.as_bytes(), &options).unwrap_err().is_usage());
        assert!(read_bytes("a.txt", lines.as_bytes(), &own).unwrap_err().to_string().contains("--rate"));
    }
    let wrong = VendorOptions { grid: Some([5, 5]), ..options.clone() };
    assert!(read_bytes("a.txt", b"1 2 3\n", &wrong).unwrap_err().to_string().contains("correct --grid"));
    let none = VendorOptions { format: Some(VendorFormat::Matrix), grid: None, ..options };
    assert!(read_bytes("a.txt", b"1 2 3\n", &none).unwrap_err().is_usage());
}

#[test]
fn columns_of_a_plain_table_that_are_no_sensors_are_recognised_or_refused() {
    let read = |text: &str, grid: [u32; 2]| {
        let options = VendorOptions { grid: Some(grid), ..VendorOptions::default() };
        read_bytes("a.txt", text.as_bytes(), &options).map_err(|e| {
            assert!(e.to_string().lines().count() == 1 && e.is_usage(), "{e}");
            e.to_string()
        })
    };
    let times =
        |text: &str, grid| -> Vec<f64> { read(text, grid).unwrap().frames.iter().map(|(t_s, _)| *t_s).collect() };
    // The unit of the time is that of its name, or of a line above the table, or of the calendar.
    let millis = "millis,a,b,c,d\n1000,512,300,10,7\n1050,500,310,12,6\n1100,500,310,12,6\n";
    assert_eq!(times(millis, [2, 2]), [1.0, 1.05, 1.1]);
    let plain = millis.split_once('\n').unwrap().1;
    assert_eq!(times(&format!("t [ms]\n{plain}"), [2, 2]), [1.0, 1.05, 1.1]);
    assert_eq!(times(&format!("t [s]\n{plain}"), [2, 2]), [1000.0, 1050.0, 1100.0]);
    assert_eq!(times(&format!("t [ms]\n{}", plain.replace(',', " ")), [2, 2]), [1.0, 1.05, 1.1]);
    assert!(read(plain, [2, 2]).unwrap_err().contains("column 1 is the time and rises by 50 a line"));
    let calendar = "1970-01-01T00:00:01Z,512,300\n1970-01-01T00:00:01.5Z,500,310\n";
    assert_eq!(times(calendar, [1, 2]), [1.0, 1.5]);
    assert_eq!(times("1768494979568 5 6\n1768494979584 5 6\n", [1, 2]), [1_768_494_979.568, 1_768_494_979.584]);
    assert!(read(millis, [1, 5]).unwrap_err().contains("column 1 is the time; correct --grid, as to 2x2"));

    // A label is not a sensor, in words or in numbers.
    let labelled = "0.0 512 300 10 walk\n0.1 500 310 12 walk\n0.2 500 310 12 run\n";
    let all = read(labelled, [1, 3]).unwrap();
    assert_eq!(singles(&all.frames[2].1), [500.0, 310.0, 12.0]);
    let rate = VendorOptions { grid: Some([1, 3]), rate_hz: Some(10.0), ..VendorOptions::default() };
    let numbered = "512 300 10 2\n500 310 12 2\n490 311 12 2\n";
    let all = read_bytes("a.txt", numbered.as_bytes(), &rate).unwrap();
    assert_eq!((all.frames[2].0, singles(&all.frames[0].1)), (0.2, vec![512.0, 300.0, 10.0]));
    assert!(
        read("512 300 10 20\n500 310 12 21\n490 311 12 25\n", [1, 3]).unwrap_err().contains("a line has 4 columns")
    );

    // Totals are left out, and refused as sensors.
    let row = |t: &str, first: f64| {
        format!("{t}\t{first}\t87.34\t91.08\t24.09\t163.9\t79.86\t{:.2}\t{:.2}\n", first + 178.42, 267.85)
    };
    let gait = [row("0.00", 199.1), row("0.01", 199.1), row("0.02", 197.12)].concat();
    let all = read(&gait, [1, 6]).unwrap();
    assert_eq!(singles(&all.frames[2].1), [197.12, 87.34, 91.08, 24.09, 163.9, 79.86]);
    // Nor is a total that stays a label, so that the time would be a sensor.
    assert!(read(&gait, [1, 8]).unwrap_err().contains("as to 1x6"));
    let above = "Rectangle width\n20\nFrame 0 (0.00 ms)\n1 2 3\n4 5 6\n\nFrame 1 (2.00 ms)\n1 2 3\n4 5 7\n";
    let blocks = VendorOptions { grid: Some([2, 3]), rate_hz: Some(500.0), ..VendorOptions::default() };
    assert_eq!(read_bytes("a.txt", above.as_bytes(), &blocks).unwrap().frames.len(), 2);
    let why = read_bytes("a.txt", above.as_bytes(), &VendorOptions::default()).unwrap_err().to_string();
    assert!(why.contains("as --grid 2x3;"), "{why}");
    let why = read(&gait, [2, 4]).unwrap_err();
    let known = "column 1 is the time, and columns 8 and 9 are the totals of columns 2 to 4 and of columns 5 to 7";
    assert!(why.contains(known) && why.contains("as to 2x3"), "{why}");
}

/// `SOMATIC_WRITE_EXAMPLES=1` writes it anew.
#[test]
fn the_example_is_what_its_recipe_makes() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/exports/insoles.csv");
    let text = make::insoles();
    if std::env::var_os("SOMATIC_WRITE_EXAMPLES").is_some() {
        std::fs::create_dir_all(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/exports")).unwrap();
        std::fs::write(path, &text).unwrap();
    }
    assert_eq!(std::fs::read_to_string(path).unwrap(), text);
    let all = plainly("insoles.csv", &text).unwrap();
    assert_eq!((all.frames.len(), all.layout.panels.len(), &all.losses[..]), (60, 2, &[][..]));
}

/// Centres of pressure may be counted from another corner of the mat than the sensors' corners are.
#[test]
fn places_are_counted_as_centres_of_pressure_are() {
    let dialect = Dialect { unit: "kPa", ..PLAIN };
    let plain = make::novel(&dialect, &[12], Some(4), &[1, 2]);
    let centre = |frame: usize| -> [f64; 2] {
        let cells = (0..12).map(|cell| (value(frame, 0, 0, cell), cell));
        let sum: f64 = cells.clone().map(|(p, _)| p).sum();
        let x: f64 = cells.clone().map(|(p, cell)| p * ((cell % 4) as f64 + 0.5)).sum();
        let y: f64 = cells.map(|(p, cell)| p * 2.0 * (9.5 - (cell / 4) as f64)).sum();
        [x / sum, y / sum]
    };
    let with = |of: &dyn Fn([f64; 2]) -> [f64; 2]| {
        let row = |frame: usize| {
            let [x, y] = of(centre(frame));
            format!("    {:.5}  1.0  {x:.3}  {y:.3}", 0.01 * frame as f64)
        };
        let text = plain.replace("    0.5  1.0  -  -", &format!("{}\n{}", row(1), row(2)));
        assert_ne!(text, plain);
        plainly("a.asc", &text).unwrap().layout.panels[0].cells[0].centre_m.map(|x| (x * 1e6).round() / 1e4)
    };
    // The first cell is at the top left, of four columns of 1 cm and three rows of 2 cm from 14 to 20 cm.
    assert_eq!(with(&|centre| centre), [0.5, 19.0]);
    assert_eq!(with(&|[x, y]| [4.0 - x, 34.0 - y]), [3.5, 15.0]);
    assert_eq!(with(&|[x, y]| [4.0 - x, y]), [3.5, 19.0]);
    // What fits neither way is as the corners have it.
    assert_eq!(with(&|[x, y]| [x + 0.3, y - 0.7]), [0.5, 19.0]);
}
