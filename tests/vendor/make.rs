//! Exports as machines in other countries write them.

use std::fmt::Write as _;

/// How a text is written.
#[derive(Clone, Copy)]
pub struct Dialect {
    pub separator: &'static str,
    pub decimal: &'static str,
    pub newline: &'static str,
    pub unit: &'static str,
    /// Leave out what need not be there.
    pub bare: bool,
}

pub const PLAIN: Dialect = Dialect { separator: ",", decimal: ".", newline: "\n", unit: "mmHg", bare: false };

impl Dialect {
    pub fn number(&self, value: f64, decimals: usize) -> String {
        format!("{value:.decimals$}").replace('.', self.decimal)
    }

    /// Cells between separators.
    pub fn row(&self, cells: &[String]) -> String {
        cells.join(self.separator)
    }

    fn finish(&self, text: &str) -> String {
        text.replace('\n', self.newline)
    }
}

/// A value to two decimals, 0 for about half of all.
pub fn value(frame: usize, sensor: usize, row: usize, column: usize) -> f64 {
    let mixed = (frame * 31 + sensor * 17 + row * 7 + column * 13) % 23;
    if mixed < 11 { 0.0 } else { 51.72 + (mixed * mixed) as f64 / 4.0 }
}

/// XSENSOR's, of `sensors` with `rows` and `columns`, the frames `numbers`, 13 ms from one number to the next.
pub fn xsensor(dialect: &Dialect, sensors: &[&str], [rows, columns]: [usize; 2], numbers: &[usize]) -> String {
    let Dialect { separator, unit, bare, .. } = *dialect;
    let n = |value: f64, decimals: usize| dialect.number(value, decimals);
    let mut text = String::new();
    if !bare {
        let _ = writeln!(text, "File:{separator}\"C:\\Füße, links.XSN\"{separator}{separator}\n");
    }
    let _ = writeln!(text, "Units:{separator}{unit}");
    if !bare {
        let _ = writeln!(text, "\nThreshold:{separator}{}\n", n(51.72, 2));
    }
    for (index, number) in numbers.iter().enumerate() {
        let milliseconds = 982 + 13 * (number - numbers[0]);
        let (second, rest) = (17 + milliseconds / 1000, milliseconds % 1000);
        let _ = writeln!(text, "FRAME{separator}{number}\n");
        let _ = writeln!(text, "Date{separator} 2022 Aug 16\n\nTime{separator} 08:21:{second}.{rest:03}\n\n");
        for (sensor, name) in sensors.iter().enumerate() {
            let _ = writeln!(text, "SENSOR{separator}{name}\nRows{separator}{rows}\nColumns{separator}{columns}");
            let _ = writeln!(text, "Sensel Width (cm){separator}{}", n(0.86, 2));
            let _ = writeln!(text, "Sensel Height (cm){separator}{}", n(0.86, 2));
            if !bare {
                let cells = (rows * columns - 3) as f64;
                let _ = writeln!(text, "Average Pressure ({unit}){separator}{}", n(1.5, 2));
                let _ = writeln!(text, "Total Area (cm²){separator}{}", n(cells * 0.7411, 2));
            }
            let _ = writeln!(text, "SENSELS");
            for row in 0..rows {
                let cells: Vec<String> = (0..columns).map(|column| n(value(*number, sensor, row, column), 2)).collect();
                let padding = if bare { String::new() } else { separator.repeat(9) };
                let _ = writeln!(text, "{}{padding}", dialect.row(&cells));
                if !bare {
                    let _ = writeln!(text, "{}", separator.repeat(19));
                }
            }
            let _ = writeln!(text);
        }
        if !bare {
            let _ = writeln!(
                text,
                "GROUP{separator}1\nName{separator}Heel\nCells{separator}36\nTotal Area (cm²){separator}{}",
                n(26.68, 2)
            );
            let _ = writeln!(text, "SENSELS\n{}\n", dialect.row(&vec![n(index as f64, 2); 20]));
        }
    }
    dialect.finish(&text)
}

/// Whether a place on Tekscan's map has a sensor: two panels of `rows` by 3, a gutter of two, and gutters around.
pub fn has_sensor([rows, _]: [usize; 2], row: usize, column: usize) -> bool {
    row > 0 && row + 1 < rows && ((1..4).contains(&column) || (6..9).contains(&column))
}

/// Tekscan's, a map of `rows` by 10.
pub fn tekscan(dialect: &Dialect, [rows, columns]: [usize; 2], numbers: &[usize]) -> String {
    let Dialect { separator, unit, bare, .. } = *dialect;
    let mut text = String::from("DATA_TYPE MOVIE\n");
    if !bare {
        let _ = writeln!(
            text,
            "VERSION Tekscan Pressure Measurement System 6.10I\nFILENAME C:\\Füße.fsx\nNOISE_THRESHOLD 3"
        );
    }
    let _ = writeln!(text, "ROWS {rows}\nCOLS {columns}\nROW_SPACING {} centimeters", dialect.number(0.127, 3));
    let _ = writeln!(text, "COL_SPACING {} centimeters", dialect.number(0.127, 3));
    if !bare {
        let _ = writeln!(text, "SENSEL_AREA {} cm2\nTIME 12/2/2019", dialect.number(0.016129, 6));
    }
    let _ = writeln!(text, "SECONDS_PER_FRAME {}\nUNITS {unit}\nASCII_DATA @@\n", dialect.number(0.1, 1));
    for number in numbers {
        let t_s = dialect.number(0.1 * (number - 1) as f64, 1);
        let _ = writeln!(
            text,
            "Frame {number}{separator} {t_s}{separator}{separator} 6:21:52{separator}Raw Sum={separator}1"
        );
        for row in 0..rows {
            let cell = |column: usize| match has_sensor([rows, columns], row, column) {
                true => format!("{}", value(*number, 0, row, column).round()),
                false => "B".to_owned(),
            };
            let _ = writeln!(text, "{}", dialect.row(&(0..columns).map(cell).collect::<Vec<_>>()));
        }
        let _ = writeln!(text);
    }
    text += "@@\n";
    dialect.finish(&text)
}

/// emed's, rows from 30 and columns from 26 on; `kpa` is what one of its units is in kPa, for the forces.
pub fn emed(dialect: &Dialect, [rows, columns]: [usize; 2], numbers: &[usize], kpa: f64) -> String {
    let n = |value: f64| dialect.number(value, 2);
    let mut text = String::new();
    for (page, number) in numbers.iter().enumerate() {
        let _ = writeln!(text, "\n\t\t\t\tPage {}\n", page + 1);
        if !dialect.bare {
            let _ = writeln!(text, "\tFile: C:\\Füße.dat \tMatrix: 64x95 ");
        }
        let _ = writeln!(text, "\tSensor area: {} cm²\tTime/picture:{} ms", n(0.25), dialect.number(10.0, 1));
        let _ = writeln!(text, "\tSensor size: {0}x{0} cm", dialect.number(0.5, 3));
        let _ = writeln!(text, "\tPict-No.: {number}  Force[N]=sum*sensor_area in row/column\n");
        let force = |sum: f64| n(sum * 0.025 * kpa);
        let heads: Vec<String> = (26..26 + columns).map(|column| column.to_string()).collect();
        let _ = writeln!(text, "\t{}\tForce", heads.join("\t"));
        let at = |row: usize, column: usize| value(*number, 0, row, column).round();
        for row in 0..rows {
            let cells: Vec<String> = (0..columns).map(|column| n(at(row, column))).collect();
            let sum: f64 = (0..columns).map(|column| at(row, column)).sum();
            let _ = writeln!(text, "{}\t{}\t{}", 30 + row, cells.join("\t"), force(sum));
        }
        let sums: Vec<f64> = (0..columns).map(|column| (0..rows).map(|row| at(row, column)).sum()).collect();
        let cells: Vec<String> = sums.iter().map(|sum| force(*sum)).collect();
        let _ = writeln!(text, "Force\t{}\t{}\n\u{C}", cells.join("\t"), force(sums.iter().sum()));
    }
    if !dialect.bare {
        let _ = writeln!(text, "\n\t\t\t\tPage 9\n\tPict-No.: MPP\n\n\t26\t27\n30\t1\t2");
    }
    dialect.finish(&text)
}

/// novel's `.asc`: `runs` with the number of sensors of each, and for pliance the places of a grid of `columns`.
pub fn novel(dialect: &Dialect, runs: &[usize], columns: Option<usize>, numbers: &[usize]) -> String {
    let mut text = String::new();
    if !dialect.bare {
        let _ = writeln!(text, "file name:  Füße.sol\tdate/time  25.04.23 10.49");
        if columns.is_none() {
            let _ = writeln!(text, "sensor type:  y-1865l");
        }
        let _ = writeln!(text, "total time [secs]:  {}\tscanning rate [Hz]: 100", dialect.number(15.05, 3));
    }
    let _ = writeln!(text, "pressure values in  {}\n", dialect.unit);
    if columns.is_none() {
        for (side, count) in ["left", "right"].iter().zip(runs) {
            let words: Vec<String> = (1..=*count).map(|number| number.to_string()).collect();
            let _ = writeln!(text, "{side} insole: {}", words.join(","));
        }
    }
    let heads: Vec<String> = runs.iter().flat_map(|count| 1..=*count).map(|number| format!("{number:>7}")).collect();
    let _ = writeln!(text, "time[secs]   {}", heads.join(" "));
    let count: usize = runs.iter().sum();
    for number in numbers {
        let cells: Vec<String> =
            (0..count).map(|cell| format!("{:>8}", dialect.number(value(*number, 0, 0, cell), 3))).collect();
        let _ = writeln!(text, "  {:>8} {}", dialect.number(0.01 * *number as f64, 5), cells.join(" "));
    }
    if let Some(columns) = columns {
        let sensors: Vec<String> = (1..=count).map(|number| number.to_string()).collect();
        let _ = writeln!(
            text,
            "        MPP 1 2 3\n\n\n time[secs] force[N]   x[cm]   y[cm]\n\n    0.5  1.0  -  -\n\n\nsensor {}\ncorner[cm]",
            sensors.join(" ")
        );
        let line = |text: &mut String, head: &str, of: &dyn Fn(usize, usize) -> f64| {
            let cells: Vec<String> =
                (0..count).map(|cell| dialect.number(of(cell / columns, cell % columns), 4)).collect();
            let _ = writeln!(text, "{head} {}", cells.join(" "));
        };
        for (corner, (right, up)) in [(0.0, 1.0), (0.0, 0.0), (1.0, 0.0), (1.0, 1.0)].into_iter().enumerate() {
            line(&mut text, &format!("x[{corner}]"), &|_, column| column as f64 + right);
            line(&mut text, &format!("y[{corner}]"), &|row, _| 2.0 * (9.0 - row as f64 + up));
        }
        line(&mut text, "x[c]", &|_, column| column as f64 + 0.5);
        line(&mut text, "y[c]", &|row, _| 2.0 * (9.5 - row as f64));
        line(&mut text, "area", &|_, _| 2.0);
    }
    dialect.finish(&text)
}

/// One foot's pressure in mmHg where it is loaded most, at `phase` of its step in 0..1, for a cell of a 31 × 11 insole.
fn under_a_foot(phase: f64, mirrored: bool, row: usize, column: usize) -> f64 {
    let column = if mirrored { 10 - column } else { column };
    let (along, across) = (row as f64, column as f64);
    // The outline: wide at the toes, narrow at the heel, hollow on the inner side of the midfoot.
    let half = match row {
        0..=1 => 3.0 + row as f64,
        2..=11 => 5.0,
        12..=21 => 3.5,
        _ => 3.8 - (along - 27.0).max(0.0) * 0.6,
    };
    let middle = if (12..=21).contains(&row) { 4.0 } else { 5.0 };
    if !(0.0..=1.0).contains(&phase) || (across - middle).abs() > half {
        return 0.0;
    }
    // Heel, outer midfoot, ball and big toe, each for its part of the step.
    let spot = |at: [f64; 2], size: f64, from: f64, to: f64, most: f64| {
        let time = ((phase - from) / (to - from)).clamp(0.0, 1.0);
        let load = (time * (1.0 - time) * 4.0).max(0.0);
        let far = ((along - at[0]) / size).powi(2) + ((across - at[1]) / (0.7 * size)).powi(2);
        most * load * (-far).exp()
    };
    let sum = spot([26.5, 5.0], 3.6, 0.0, 0.55, 900.0)
        + spot([17.0, 3.0], 4.5, 0.1, 0.75, 220.0)
        + spot([8.0, 5.0], 4.2, 0.25, 0.97, 820.0)
        + spot([2.0, 7.0], 2.2, 0.45, 1.0, 1050.0);
    if sum < 51.72 { 0.0 } else { (sum * 100.0).round() / 100.0 }
}

/// The example of the documentation: two insoles, a step of each foot, as XSENSOR writes it with its totals.
pub fn insoles() -> String {
    const CELL_CM2: f64 = 174.17 / 235.0;
    let mut text = String::from("\u{FEFF}File:,\"made up by somatic, walking.XSN\"\nUnits:,mmHg\nThreshold:,51.72\n");
    for frame in 0..60 {
        let t_s = frame as f64 * 0.02;
        let _ = writeln!(text, "FRAME,{}\nDate, 2024 Mar 01\nTime, 10:00:{:06.3}", 100 + frame, t_s);
        for (name, begin_s, mirrored) in
            [("HX210.11.31.M11-LF S0001", 0.02, false), ("HX210.11.31.M11-RF S0001", 0.52, true)]
        {
            let phase = (t_s - begin_s) / 0.62;
            let at = |row: usize, column: usize| under_a_foot(phase, mirrored, row, column);
            let cells: Vec<f64> = (0..341).map(|cell| at(cell / 11, cell % 11)).collect();
            let pressed: Vec<f64> = cells.iter().copied().filter(|cell| *cell > 0.0).collect();
            let sum: f64 = pressed.iter().sum();
            let average = if pressed.is_empty() { 0.0 } else { sum / pressed.len() as f64 };
            let load = sum * 133.322_387_415 * CELL_CM2 * 1e-4;
            let _ =
                writeln!(text, "SENSOR,{name}\nRows,31\nColumns,11\nSensel Width (cm),0.86\nSensel Height (cm),0.86");
            let _ = writeln!(text, "Average Pressure (mmHg),{average:.2}");
            let _ = writeln!(text, "Peak Pressure (mmHg),{:.2}", pressed.iter().copied().fold(0.0, f64::max));
            let _ =
                writeln!(text, "Contact Area (cm²),{:.2}\nTotal Area (cm²),174.17", pressed.len() as f64 * CELL_CM2);
            let _ = writeln!(text, "Est. Load (N),{load:.2}\nSENSELS");
            for row in cells.chunks(11) {
                let words: Vec<String> = row.iter().map(|cell| format!("{cell}")).collect();
                let _ = writeln!(text, "{}", words.join(","));
            }
        }
    }
    text
}

/// The value of cell `index` of [`xsensor_groups`] in frame `number`: another one than that of every other cell, or 0 in every third frame.
pub fn grouped_value(number: usize, index: usize) -> f64 {
    if (number + index).is_multiple_of(3) { 0.0 } else { (100 + 7 * index) as f64 + 0.5 * number as f64 }
}

/// XSENSOR's with groups: two sensors of 4 × 3 cells, and their groups, which print the cells of [`GROUPS`] in that order.
pub fn xsensor_groups(numbers: &[usize]) -> String {
    let mut text = "Units:,mmHg\n".to_owned();
    let n = |number: usize, index: usize| format!("{}", grouped_value(number, index));
    for number in numbers {
        let _ = writeln!(text, "FRAME,{number}\nTime, 08:21:17.{:03}", 13 * number);
        for (sensor, name) in ["a-LF", "a-RF"].into_iter().enumerate() {
            let _ = writeln!(
                text,
                "SENSOR,{name}\nRows,4\nColumns,3\nSensel Width (cm),0.86\nSensel Height (cm),0.86\nSENSELS"
            );
            for row in 0..4 {
                let cells: Vec<String> = (0..3).map(|column| n(*number, 12 * sensor + 3 * row + column)).collect();
                let _ = writeln!(text, "{}", cells.join(","));
            }
        }
        for (index, (name, cells)) in GROUPS.iter().enumerate() {
            let _ = writeln!(text, "GROUP,{}\nName,{name}\nCells,{}\nContact %,0\nSENSELS", index + 1, cells.len());
            for part in cells.chunks(4) {
                let _ = writeln!(text, "{}", part.iter().map(|&cell| n(*number, cell)).collect::<Vec<_>>().join(","));
            }
        }
    }
    text
}

/// The groups of [`xsensor_groups`]: their names, and the cells of both sensors that they have, in the file's order.
pub const GROUPS: [(&str, &[usize]); 3] =
    [("Left Heel", &[11, 8, 7, 10, 9, 6]), ("Right Toe", &[14, 13, 12]), ("Both sides", &[1, 13])];

/// XSENSOR's of newer programs: quotation marks, colons, decimal commas, and no line above a table. One sensor of 2 × 3 cells.
pub fn xsensor_newer(numbers: &[usize]) -> String {
    let mut text = "\"File:\",\"C:\\mat, new.xsn\"\n\"Units:\",\"mmHg\"\n\"Threshold:\",\"51,72\"\n\n".to_owned();
    for number in numbers {
        let _ = writeln!(
            text,
            "\"Frame:\",\"{number}\"\n\"Date:\",\"16-8-2022\"\n\"Time:\",\"08:21:17,{:03}\"",
            13 * number
        );
        text += "\"Sensor:\",\"PX100.L S0000\"\n\"Rows:\",\"2\"\n\"Columns:\",\"3\"\n\"Sensel Width (cm):\",\"0,86\"\n\"Sensel Height (cm):\",\"0,5\"\n";
        text += "\"Total Area (cm²):\",\"2,58\"\n\"COP Row:\",\"1,00\"\n\n";
        for row in 0..2 {
            let cells: Vec<String> =
                (0..3).map(|column| format!("\"{:.2}\"", value(*number, 0, row, column)).replace('.', ",")).collect();
            let _ = writeln!(text, "{}", cells.join(","));
        }
        text += "\n";
    }
    text
}

/// loadsol's of `devices`, each with three zones, their total and two more columns.
pub fn loadsol(devices: &[&str], numbers: &[usize]) -> String {
    let mut text = "trial.loadflux\ncomment \n".to_owned();
    let zones = ["::lateral", "::medial", "::heel", ""];
    let names = devices.iter().map(|device| {
        let forces: Vec<String> = zones.iter().map(|zone| format!("{device}{zone}")).collect();
        format!("\t{}\t\t{device}::xAcc", forces.join("\t"))
    });
    let _ = writeln!(text, "{}\t", names.collect::<Vec<_>>().join("\t"));
    let units = vec!["Time[secs]\tForce[N]\tForce[N]\tForce[N]\tForce[N]\tTime[secs]\t[g]"; devices.len()];
    let _ = writeln!(text, "{}\t", units.join("\t"));
    for number in numbers {
        let row = (0..devices.len()).map(|device| {
            let forces: Vec<f64> = (0..3).map(|zone| value(*number, device, 0, zone)).collect();
            let t_s = 0.005 * *number as f64;
            let cells: Vec<String> = forces.iter().map(|force| format!("{force:.3}")).collect();
            format!("{t_s:.3}\t{}\t{:.3}\t{t_s:.3}\t-1.345", cells.join("\t"), forces.iter().sum::<f64>())
        });
        let _ = writeln!(text, "{}\t", row.collect::<Vec<_>>().join("\t"));
    }
    text
}

/// footscan's of `sides`, one after the other, each on a rectangle of `rows` by `columns`, 2 ms from one frame to the next.
pub fn footscan(sides: &[&str], [rows, columns]: [usize; 2], numbers: &[usize]) -> String {
    let mut text = "Dynamic Roll offfor measurement: Trial_1\nPatient name: NA\n\n".to_owned();
    for (foot, side) in sides.iter().enumerate() {
        let _ = writeln!(
            text,
            "{side} foot data\n\n{side} rectangle position\nRectangle bottom\n6\nRectangle left\n{}",
            20 * foot
        );
        let _ = writeln!(text, "Rectangle width\n{columns}\nRectangle height\n{rows}\n");
        for number in numbers {
            let _ = writeln!(text, "Frame {} ({:.2} ms)", number - numbers[0], 2.0 * (number - numbers[0]) as f64);
            for row in 0..rows {
                let cells: Vec<String> =
                    (0..columns).map(|column| format!("{}", value(*number, foot, row, column))).collect();
                let _ = writeln!(text, "{}", cells.join("\t"));
            }
            text += "\n";
        }
    }
    text
}

/// StappOne's of `soles`, four sensors each, 16 ms from one row of a sole to the next.
pub fn stappone(soles: &[u32], numbers: &[usize]) -> String {
    let mut text = "sole_id,timestamp,accel_x,pressure_01,pressure_02,pressure_03,pressure_04,corrupt\n".to_owned();
    for number in numbers {
        for (sole, id) in soles.iter().enumerate() {
            let cells: Vec<String> = (0..4).map(|cell| format!("{}", value(*number, sole, 0, cell).round())).collect();
            let _ = writeln!(text, "{id},{},-1780,{},0", 1_768_494_979_568 + 16 * number, cells.join(","));
        }
    }
    text
}
