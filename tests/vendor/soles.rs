//! Systems under feet: footscan, loadsol and StappOne; and what XSENSOR's newer programs and groups add.

use somatic::internal::source::Panel;
use somatic::source::{Source as _, VendorFormat, VendorOptions, VendorSource};
use somatic::{Body, RawValue, Result};

use crate::common::data;
use crate::make::{self, GROUPS, value};
use crate::{Read, file, read, read_bytes};

fn plainly(name: &str, text: &str) -> Result<Read> {
    read_bytes(name, text.as_bytes(), &VendorOptions::default())
}

fn numbers(values: &[RawValue]) -> Vec<Option<f64>> {
    values.iter().map(|value| value.number()).collect()
}

/// Those of a frame as they were made.
fn right(values: impl IntoIterator<Item = f64>) -> Vec<Option<f64>> {
    values.into_iter().map(|value| Some(f64::from(value as f32))).collect()
}

fn understood(text: &str) -> String {
    let (_folder, path) = file("a.txt", text.as_bytes());
    VendorSource::open(&path, &VendorOptions::default()).unwrap().notices().join("\n")
}

/// A file that was made elsewhere, if it is there.
fn real(name: &str) -> Option<Read> {
    let path = data("failing")?.join(name);
    Some(read(&path, &VendorOptions::default()).unwrap_or_else(|e| panic!("{e}")))
}

fn names(panels: &[Panel]) -> Vec<&str> {
    panels.iter().map(|panel| panel.name.as_str()).collect()
}

#[test]
fn footscan_has_a_foot_after_the_other_each_on_its_rectangle() {
    let text = make::footscan(&["Left", "Right"], [4, 3], &[5, 6, 9]);
    let all = plainly("a.txt", &text).unwrap();
    assert_eq!((all.format, names(&all.layout.panels)), (VendorFormat::Footscan, vec!["left", "right"]));
    assert_eq!(all.frames.iter().map(|(t_s, _)| *t_s).collect::<Vec<_>>(), [0.0, 0.002, 0.008, 0.0, 0.002, 0.008]);
    let foot = |number, foot| right((0..12).map(move |cell| value(number, foot, cell / 3, cell % 3)));
    assert_eq!(numbers(&all.frames[1].1), [foot(6, 0), vec![None; 12]].concat());
    assert_eq!(numbers(&all.frames[5].1), [vec![None; 12], foot(9, 1)].concat());
    // The first row is at the bottom, and columns go to the right.
    let [first, last] = [all.layout.panels[0].cells[0], all.layout.panels[0].cells[11]];
    assert!(first.centre_m[1] < last.centre_m[1] && first.centre_m[0] < last.centre_m[0], "{first:?}, {last:?}");
    assert!((first.area_m2 - 0.005_08 * 0.007_62).abs() < 1e-12 && all.layout.unit.to_string() == "N");
    // 20 columns of the plate between the feet, and 6 rows below both.
    let [left, right] = [all.layout.panels[0].offset_m, all.layout.panels[1].offset_m];
    assert!((right[0] - left[0] - 20.0 * 0.005_08).abs() < 1e-12 && (left[1] - 8.0 * 0.007_62).abs() < 1e-12);
    let said = understood(&text);
    assert!(said.contains("--pitch") && said.contains("in N") && said.contains("the right foot comes after"), "{said}");
    let given = VendorOptions { pitch_m: Some([0.01, 0.02]), unit: "kPa".parse().ok(), ..VendorOptions::default() };
    let all = read_bytes("a.txt", text.as_bytes(), &given).unwrap();
    assert!((all.layout.panels[0].cells[0].area_m2 - 2e-4).abs() < 1e-15 && all.layout.unit.to_string() == "kPa");
    for (old, new, why) in [
        ("Right foot data", "Left foot data", "the left foot is there twice"),
        ("Rectangle height\n4", "Rectangle height\n0", "0 rows and 3 columns are not a sensor"),
        ("Rectangle height\n4", "Rectangle height\n9", "has 4 of 9 rows"),
        ("Rectangle width\n3", "Rectangle width\n2", "follows the last of its 2 columns"),
        ("Frame 1 (2.00 ms)", "Frame one", "is not `Frame NUMBER (TIME ms)`"),
    ] {
        let error = plainly("a.txt", &text.replace(old, new)).unwrap_err().to_string();
        assert!(error.contains(why) && !error.contains('\n'), "{error}");
    }
    let skip = VendorOptions { skip_bad: true, ..VendorOptions::default() };
    let all = read_bytes("a.txt", text.replacen("Frame 1 (2.00 ms)\n", "Frame 1 (2.00 ms)\nx\n", 1).as_bytes(), &skip)
        .unwrap();
    assert_eq!((all.frames.len(), all.losses.len()), (5, 1), "{:?}", all.losses);
}

#[test]
fn footscan_that_was_exported_elsewhere_is_read() {
    let Some(all) = real("footscan.txt") else { return };
    assert_eq!((names(&all.layout.panels), all.frames.len(), all.losses.len()), (vec!["right"], 2, 0));
    assert_eq!((all.ids.len(), all.frames[1].0), (760, 0.002));
    let sum = |frame: usize| numbers(&all.frames[frame].1).into_iter().flatten().sum::<f64>();
    // Added up from the text.
    let text = std::fs::read_to_string(data("failing").unwrap().join("footscan.txt")).unwrap();
    let of_frame = |frame: usize| -> f64 {
        let part = text.split("Frame ").nth(frame + 1).unwrap();
        part.lines().skip(1).flat_map(|line| line.split('\t')).filter_map(|cell| cell.trim().parse::<f64>().ok()).sum()
    };
    assert!((sum(0) - of_frame(0)).abs() < 1e-4 && sum(1) > sum(0) && (sum(1) - of_frame(1)).abs() < 1e-4);
}

#[test]
fn loadsol_has_the_zones_of_each_insole() {
    let text = make::loadsol(&["A12-L", "L33-R"], &[1, 2, 9]);
    let all = plainly("a.txt", &text).unwrap();
    assert_eq!((all.format, names(&all.layout.panels)), (VendorFormat::Loadsol, vec!["left", "right"]));
    let forces = (0..6).map(|cell| value(9, cell / 3, 0, cell % 3));
    assert_eq!((all.frames[2].0, numbers(&all.frames[2].1)), (0.045, right(forces)));
    let zones: Vec<&str> = all.layout.panels[1].parts.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(
        (zones, all.layout.is_placed(), all.layout.unit.to_string()),
        (vec!["lateral", "medial", "heel"], false, "N".to_owned())
    );
    let said = understood(&text);
    assert!(
        said.contains("A12-L: column 2 lateral, column 3 medial, column 4 heel; of L33-R: column 9 lateral"),
        "{said}"
    );
    // A dash is no reading, and one number is all that a single sensor has.
    let gone = text.replacen("\n0.010\t", "\n0.010\t-\t-\t-\t-\t", 1);
    let dashed: String = gone
        .lines()
        .map(|line| {
            let cells: Vec<&str> = line.split('\t').collect();
            if cells.get(1) == Some(&"-") {
                [&cells[..5], &cells[9..]].concat().join("\t") + "\n"
            } else {
                format!("{line}\n")
            }
        })
        .collect();
    let missing = plainly("a.txt", &dashed).unwrap();
    assert_eq!(numbers(&missing.frames[1].1)[..3], [None; 3]);
    assert_eq!(missing.frames[1].1[3..], all.frames[1].1[3..]);
    let single = "one.loadflux\n\n\tB7-R\t\nTime[secs]\tForce[N]\t\n0.00\t1.5\t\n0.01\t2.5\t\n";
    let all = plainly("a.txt", single).unwrap();
    assert_eq!((names(&all.layout.panels), numbers(&all.frames[1].1)), (vec!["right"], vec![Some(2.5)]));
    let two = single.replace("Force[N]\t", "Force[N]\tForce[lbf]\t");
    assert!(plainly("a.txt", &two).is_err());
    if let Some(all) = real("loadsol.txt") {
        assert_eq!((names(&all.layout.panels), all.ids.len(), all.frames.len()), (vec!["right"], 3, 4));
        assert_eq!((all.frames[3].0, numbers(&all.frames[3].1)), (0.015, vec![Some(0.0); 3]));
    }
}

#[test]
fn stappone_has_a_frame_for_each_time() {
    let text = make::stappone(&[1, 2], &[1, 2, 9]);
    let all = plainly("a.csv", &text).unwrap();
    assert_eq!((all.format, names(&all.layout.panels)), (VendorFormat::Stappone, vec!["sole_1", "sole_2"]));
    assert_eq!((&all.ids[..], all.frames.len()), (&[101, 102, 103, 104, 201, 202, 203, 204][..], 3));
    let cells = (0..8).map(|cell| value(9, cell / 4, 0, cell % 4).round());
    assert_eq!((all.frames[2].0, numbers(&all.frames[2].1)), (1_768_494_979.712, right(cells)));
    let said = understood(&text);
    assert!(said.contains("columns 4 to 7: 4 sensors of soles 1 and 2; the other columns are left out"), "{said}");
    // A row that is marked has no values. A sole that is late keeps its own for a moment.
    let mut rows: Vec<String> = text.lines().map(str::to_owned).collect();
    let marked = format!("{},1", rows[3].rsplit_once(',').unwrap().0);
    rows[3] = marked;
    rows.remove(4);
    let all = plainly("a.csv", &(rows.join("\n") + "\n")).unwrap();
    assert_eq!(all.losses.len(), 1, "{:?}", all.losses);
    assert!(all.losses[0].contains("a row is marked as corrupt"));
    assert_eq!(numbers(&all.frames[1].1)[..4], [None; 4]);
    assert_eq!(all.frames[1].1[4..], all.frames[0].1[4..], "kept for 16 ms");
    assert_eq!(numbers(&all.frames[2].1).iter().flatten().count(), 8);
    rows.remove(5);
    let all = plainly("a.csv", &(rows.join("\n") + "\n")).unwrap();
    assert_eq!(numbers(&all.frames[2].1)[4..], [None; 4], "not for 128 ms");
    // What is cut short keeps the frame before.
    let whole = plainly("a.csv", &text).unwrap();
    let cut = plainly("a.csv", &text[..text.len() - 12]).unwrap();
    assert_eq!((cut.frames.len(), cut.losses.len()), (3, 1), "{:?}", cut.losses);
    assert_eq!(cut.frames[..2], whole.frames[..2]);
    if let Some(all) = real("stappone.csv") {
        assert_eq!((all.ids.len(), all.frames.len(), &all.losses[..]), (12, 3, &[][..]));
        assert_eq!(numbers(&all.frames[2].1)[..2], [Some(362.0), Some(474.0)]);
    }
}

#[test]
fn newer_layouts_of_xsensor_have_quotation_marks_and_decimal_commas() {
    let all = plainly("a.csv", &make::xsensor_newer(&[1, 2, 4])).unwrap();
    assert_eq!((all.format, names(&all.layout.panels)), (VendorFormat::Xsensor, vec!["left"]));
    assert_eq!(all.frames.iter().map(|(t_s, _)| *t_s).collect::<Vec<_>>(), [0.0, 0.013, 0.039]);
    assert_eq!(
        numbers(&all.frames[2].1),
        right((0..6).map(|cell| (value(4, 0, cell / 3, cell % 3) * 100.0).round() / 100.0))
    );
    let cell = all.layout.panels[0].cells[0];
    assert!((cell.area_m2 - 0.43e-4).abs() < 1e-9 && all.layout.unit.to_string() == "mmHg", "{cell:?}");
    let Some(all) = real("xsensor-pro7.csv") else { return };
    assert_eq!((names(&all.layout.panels), all.frames.len(), all.ids.len()), (vec!["left", "right"], 2, 682));
    // The maker's own peaks, loads and means.
    let of =
        |frame: usize, side: usize| numbers(&all.frames[frame].1[341 * side..341 * (side + 1)]).into_iter().flatten();
    let peak = |frame, side| of(frame, side).fold(0.0, f64::max);
    assert_eq!(
        [peak(0, 0), peak(0, 1), peak(1, 0), peak(1, 1)].map(|p| (p * 100.0).round() / 100.0),
        [2674.44, 312.51, 2807.56, 331.7]
    );
    let load = |frame, side| of(frame, side).sum::<f64>() * 133.322 * all.layout.panels[side].cells[0].area_m2;
    for (own, printed) in [load(0, 0), load(0, 1), load(1, 0), load(1, 1)].into_iter().zip([411.67, 54.97, 384.1, 66.8])
    {
        assert!((own / printed - 1.0).abs() < 2e-3, "{own} is not {printed}");
    }
}

#[test]
fn groups_of_xsensor_are_fields() {
    let text = make::xsensor_groups(&[1, 2, 3]);
    let all = plainly("a.csv", &text).unwrap();
    let ids = |cells: &[usize]| -> Vec<u32> {
        let mut ids: Vec<u32> = cells.iter().map(|&cell| cell as u32).collect();
        ids.sort_unstable();
        ids
    };
    let parts: Vec<(String, Vec<u32>)> = all
        .layout
        .panels
        .iter()
        .flat_map(|panel| panel.parts.iter().map(|(name, ids)| (format!("{}/{name}", panel.name), ids.clone())))
        .collect();
    let wanted = [
        ("left/heel".to_owned(), ids(GROUPS[0].1)),
        ("left/both_sides".to_owned(), ids(&[1])),
        ("right/toe".to_owned(), ids(GROUPS[1].1)),
        ("right/both_sides".to_owned(), ids(&[13])),
    ];
    assert_eq!(parts, wanted);
    let (_folder, path) = file("a.csv", text.as_bytes());
    let mut source = VendorSource::open(&path, &VendorOptions::default()).unwrap();
    assert!(source.notices()[0].contains("left/heel (6 of 6 cells)"));
    let body = Body::from_bytes("a.glb", &source.body().unwrap()).unwrap();
    let fields: Vec<&str> = body.fields.iter().map(|field| field.name.as_str()).collect();
    assert!(body.findings.is_empty() && fields.contains(&"left/heel") && fields.contains(&"right"), "{fields:?}");
    // Frames are as without groups.
    let without: String = text
        .split_inclusive("FRAME")
        .map(|part| {
            part.split("GROUP").next().unwrap().to_owned()
                + if part.ends_with("FRAME") && part.contains("GROUP") { "FRAME" } else { "" }
        })
        .collect();
    assert_eq!(plainly("a.csv", &without).unwrap().frames, all.frames);
}

#[test]
fn groups_of_real_insoles_add_up_to_the_makers_loads() {
    let Some(path) = data("recordings/vendor").map(|folder| folder.join("xsensor_first12.csv")) else { return };
    let all = read(&path, &VendorOptions::default()).unwrap();
    let printed = printed_groups(&std::fs::read(&path).unwrap());
    let mut compared = 0;
    for panel in &all.layout.panels {
        for (part, ids) in &panel.parts {
            let name = format!("{} {part}", panel.name);
            for (frame, loads) in printed.iter().enumerate() {
                let (_, load) = loads.iter().find(|(own, _)| own.eq_ignore_ascii_case(&name)).unwrap();
                let sum: f64 = ids.iter().filter_map(|id| all.frames[frame].1[*id as usize].number()).sum();
                let own = sum * 133.322 * panel.cells[0].area_m2;
                assert!((own - load).abs() <= 0.006 + 2e-4 * load, "{name} in frame {frame}: {own} is not {load}");
                compared += usize::from(*load > 0.0);
            }
        }
    }
    // Four groups that are pressed, in twelve frames; one is not in four of them.
    assert_eq!(compared, 44);
    // In a single frame two cells may have one value, and neither is believed.
    let Some(all) = real("xsensor-groups.csv") else { return };
    let parts: Vec<(&str, usize)> = all
        .layout
        .panels
        .iter()
        .flat_map(|panel| panel.parts.iter().map(|(name, ids)| (name.as_str(), ids.len())))
        .collect();
    assert_eq!(parts, [("metatarsal", 44), ("toe", 44), ("heel", 28)]);
}

/// By frame, the names of the groups and their loads, N.
fn printed_groups(bytes: &[u8]) -> Vec<Vec<(String, f64)>> {
    let text = String::from_utf8_lossy(bytes);
    let frames = text.split("FRAME,").skip(1).map(|frame| {
        let groups = frame.split("GROUP,").skip(1).map(|group| {
            let after =
                |key: &str| group.lines().find_map(|line| line.strip_prefix(key)).unwrap().split(',').next().unwrap();
            (after("Name,").to_owned(), after("Est. Load (N),").parse().unwrap())
        });
        groups.collect()
    });
    frames.collect()
}
