//! The iCub's position files, where they are at hand: every row of each accounted for.

use std::collections::BTreeMap;

use somatic::Body;
use somatic::body::Modality;
use somatic::field::FieldSet;
use somatic::internal::author::icub::{IcubFile, IcubRow, NormalFrom};

use crate::common::data;

/// What a file holds: rows, ids, taxels for pressure, thermal pads with a place, absent rows, ids without a place, thermal
/// pads without, disowned places, places shared by several and the taxels on them, scaled normals, fields below the part's.
type Account = [usize; 12];

#[test]
fn each_file_is_read_to_its_last_row() {
    let Some(folder) = data("layouts/icub") else { return };
    let known: BTreeMap<&str, (&str, Account)> = BTreeMap::from([
        ("left_forearm_V2.txt", ("l_forearm", [384, 384, 240, 0, 144, 0, 0, 0, 20, 112, 0, 24])),
        ("left_forearm_mesh.txt", ("l_forearm", [384, 384, 276, 0, 108, 0, 0, 0, 0, 0, 265, 23])),
        ("left_hand_V2_1.txt", ("l_hand", [192, 192, 44, 0, 84, 60, 0, 4, 0, 0, 0, 5])),
        ("left_leg_upper.txt", ("l_upper_leg", [1344, 960, 680, 0, 570, 0, 94, 0, 0, 0, 0, 68])),
        ("torso.txt", ("chest", [768, 768, 440, 88, 240, 0, 0, 0, 15, 96, 0, 44])),
    ]);
    let mut seen = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.extension().is_none_or(|e| e != "txt") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let file = IcubFile::read(&text).unwrap();
        let &(part, account) = known.get(name).unwrap_or_else(|| panic!("say in this test what is in {name}"));
        assert_eq!(file.part, part);
        let count = |is: &dyn Fn(&IcubRow) -> bool| file.rows.iter().filter(|row| is(row)).count();
        let of = |modality| count(&|row| matches!(row, IcubRow::Taxel(taxel) if taxel.modality == modality));
        let shared = file.shared_places();
        let scaled = file.taxels().filter(|(_, taxel)| taxel.normal == NormalFrom::Scaled).count();
        let found = [
            file.rows.len(),
            file.ids,
            of(Modality::Pressure),
            of(Modality::Temperature),
            count(&|row| *row == IcubRow::Absent),
            count(&|row| matches!(row, IcubRow::Unplaced(0..))),
            count(&|row| *row == IcubRow::Unplaced(-2)),
            count(&|row| *row == IcubRow::Disowned),
            shared.len(),
            shared.iter().map(Vec::len).sum(),
            scaled,
            file.fields(0).len() - 1,
        ];
        assert_eq!(found, account, "{name}: {:?}", file.notes);
        // Nothing is in two kinds, nothing in none.
        assert_eq!(found[2..8].iter().sum::<usize>(), file.rows.len(), "{name}");
        assert!(file.taxels().all(|(_, taxel)| (taxel.normal_in_link.length() - 1.0).abs() < 1e-12));

        // Row by row against the text: channel, place, group.
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip_while(|line| line.trim() != "[calibration]")
            .skip(1)
            .filter(|line| !line.trim().is_empty())
            .map(|line| line.split_whitespace().map(|word| word.parse().unwrap()).collect())
            .collect();
        for (channel, taxel) in file.taxels() {
            assert_eq!(taxel.position_in_link.to_array(), rows[channel as usize][..3]);
        }

        // Every group of the file is a field, and every taxel for pressure in exactly one.
        let body = Body::from_bytes(name, &file.to_glb().to_bytes().unwrap()).unwrap();
        assert_eq!(body.taxels.len(), file.taxels().count());
        let fields = FieldSet::new(&body).unwrap();
        assert_eq!(fields.fields[0].name, part);
        let below: usize = fields.fields[1..].iter().map(|field| field.members.len()).sum();
        assert_eq!((fields.fields[0].members.len(), below), (account[2], account[2]));
        eprintln!("{name}\n  {}", file.notes.join("\n  "));
        seen += 1;
    }
    assert_eq!(seen, known.len());
}

#[test]
fn a_board_with_more_ids_than_rows_goes_onto_a_body() {
    // As the files of both feet, arms and lower legs: 960 ids for 384 rows, those beyond all −1.
    let mut text = "name l_foot\nspatial_sampling taxel\ntaxel2Repr (".to_owned();
    for channel in 0..960 {
        text += &if channel < 384 { format!(" {}", channel / 12 * 12) } else { " -1".to_owned() };
    }
    text += " )\n[calibration]\n";
    for channel in 0..384 {
        text += &format!("{} {} 0 0 0 1\n", 0.004 * f64::from(channel % 24), 0.004 * f64::from(channel / 24));
    }
    let file = IcubFile::read(&text).unwrap();
    assert_eq!((file.rows.len(), file.ids, file.taxels().count(), file.fields(0).len()), (384, 960, 384, 33));
    assert!(file.notes.iter().any(|note| note.starts_with("576 ids -1 beyond the last row")), "{:?}", file.notes);
    let body = Body::from_bytes("foot", &file.to_glb().to_bytes().unwrap()).unwrap();
    assert_eq!(body.taxels.len(), 384);
    let why = IcubFile::read(&text.replacen(" -1 )", " 12 )", 1)).unwrap_err().to_string();
    assert!(why.contains("row 959 the id 12 and there are only 384 rows: the file is cut short"), "{why}");
}
