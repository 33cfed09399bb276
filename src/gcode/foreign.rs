//! What other controls mean: codes that the table of codes does not have, and lines of other
//! languages. Nothing here is executed; it tells the reader of a diagnostic what was found.

use super::fault::Fault;
use super::rules;

/// A code of other controls.
#[derive(Debug, PartialEq, Eq)]
pub struct Foreign {
    /// `G` or `M`.
    pub letter: u8,
    /// Ten times the code's number: from the first to the last that is meant.
    pub tenths: (u16, u16),
    /// Whose code it is.
    pub control: &'static str,
    /// What it means there.
    pub meaning: &'static str,
    /// What to write instead.
    pub instead: &'static str,
}

impl Foreign {
    /// As it is written: `M104`, `M100 to M199`.
    pub fn name(&self) -> String {
        let letter = char::from(self.letter);
        let name = |tenths: u16| match tenths % 10 {
            0 => format!("{letter}{}", tenths / 10),
            tenth => format!("{letter}{}.{tenth}", tenths / 10),
        };
        let (first, last) = self.tenths;
        if first == last { name(first) } else { format!("{} to {}", name(first), name(last)) }
    }
}

/// What a code means on other controls, if it is known.
pub fn find(letter: u8, number: f64) -> Option<&'static Foreign> {
    let tenths = number * 10.0;
    // A code of one tenth at most is meant: 1e-6 forgives the product's rounding.
    if !(0.0..=65_000.0).contains(&tenths) || (tenths - tenths.round()).abs() > 1e-6 {
        return None;
    }
    let tenths = tenths.round() as u16;
    let is_whole = tenths.is_multiple_of(10);
    let is_it = |row: &&Foreign| {
        let (first, last) = row.tenths;
        row.letter == letter && (first..=last).contains(&tenths) && (first == last || is_whole)
    };
    FOREIGN.iter().find(is_it)
}

const fn g(
    tenths: u16,
    control: &'static str,
    meaning: &'static str,
    instead: &'static str,
) -> Foreign {
    Foreign { letter: b'G', tenths: (tenths, tenths), control, meaning, instead }
}

const fn m(
    number: u16,
    control: &'static str,
    meaning: &'static str,
    instead: &'static str,
) -> Foreign {
    ms(number, number, control, meaning, instead)
}

const fn ms(
    first: u16,
    last: u16,
    control: &'static str,
    meaning: &'static str,
    instead: &'static str,
) -> Foreign {
    Foreign { letter: b'M', tenths: (first * 10, last * 10), control, meaning, instead }
}

const OUT: &str = "leave it out";
const LATHE: &str = "let the CAM program put out single moves in place of the lathe cycle";
const PRINTER: &str = "this is a program for a 3D printer: no machine tool can run it";
const LINES: &str = "write its moves as G0 and G1 blocks";
const FIXED: &str = "let the CAM program put out positions of the machine's own axes";
const CHECK: &str = "leave it out, if the machine does not need it; else do it by hand at an M0";

/// The codes, a row each; where several controls differ, the meanings most often met.
#[rustfmt::skip]
pub static FOREIGN: &[Foreign] = &[
    g(71, "FANUC", "cylindrical interpolation", FIXED),
    g(110, "FANUC", "ends the data entry of G10; on 3D printers: takes the filament back", OUT),
    g(120, "Haas, Mach3", "circular pocket, clockwise; on Siemens: a Cartesian zero", LINES),
    g(121, "FANUC", "polar coordinate interpolation of a lathe's live tools", FIXED),
    g(130, "Haas, Mach3", "circular pocket, counter-clockwise", LINES),
    g(131, "FANUC", "ends polar coordinate interpolation", FIXED),
    g(171, "LinuxCNC", "plane of U and V", "write G17: arcs lie in planes of X, Y and Z"),
    g(181, "LinuxCNC", "plane of W and U", "write G18: arcs lie in planes of X, Y and Z"),
    g(191, "LinuxCNC", "plane of V and W", "write G19: arcs lie in planes of X, Y and Z"),
    g(220, "FANUC", "stored limits of travel on", "leave it out: the machine profile holds the travel"),
    g(230, "FANUC", "stored limits of travel off", "leave it out: the machine profile holds the travel"),
    g(250, "FANUC, Siemens", "lower limit of the spindle's speed, or its supervision off", OUT),
    g(260, "FANUC, Siemens", "upper limit of the spindle's speed, or its supervision on", OUT),
    g(270, "FANUC", "checks the return to the reference position", OUT),
    g(290, "FANUC", "returns from the reference position; on 3D printers: measures the bed", "write the position as a G0 block"),
    g(320, "FANUC lathes", "thread cutting; on 3D printers: bed probe", "take --dialect fanuc-lathe, if it is a program for a lathe"),
    g(340, "FANUC lathes", "thread of varying lead; on Haas: bolt circle", LATHE),
    g(350, "Haas, FANUC lathes", "measures a tool's diameter, or automatically", CHECK),
    g(360, "Haas, FANUC lathes", "measures the work's centre, or a tool automatically", CHECK),
    g(370, "FANUC, Haas", "measures a tool's length automatically", CHECK),
    g(390, "FANUC", "rounds a corner in compensation", OUT),
    g(434, "FANUC", "tool centre point control on five axes", FIXED),
    g(435, "FANUC", "tool centre point control on five axes", FIXED),
    g(450, "FANUC", "lengthens a move by a tool offset", "use G41 or G42"),
    g(460, "FANUC", "shortens a move by a tool offset", "use G41 or G42"),
    g(470, "FANUC", "lengthens a move by two tool offsets; on Haas: engraves text", "use G41 or G42"),
    g(480, "FANUC", "shortens a move by two tool offsets", "use G41 or G42"),
    g(600, "FANUC, Siemens", "approaches from one side; on Siemens: exact stop mode", "write the approach as two moves"),
    g(620, "FANUC", "slows down in inside corners", OUT),
    g(630, "FANUC, Siemens", "tapping mode, feed not to be overridden", OUT),
    g(682, "FANUC", "tilted work plane", FIXED),
    g(750, "FANUC lathes", "grooving cycle; on Siemens: goes to a fixed point", "take --dialect fanuc-lathe, if it is a program for a lathe"),
    g(770, "Haas lathes", "flattening cycle", LATHE),
    g(780, "FANUC lathes", "threading cycle", LATHE),
    g(790, "Heidenhain", "calls a cycle; on FANUC lathes: facing cycle", LINES),
    g(9610, "Siemens", "constant surface speed with feed a turn", "write G96 and G95"),
    g(9710, "Siemens", "S in turns a minute with feed a turn", "write G97 and G95"),
    Foreign { letter: b'G', tenths: (1000, 1000), control: "Haas", meaning: "mirror images off", instead: "write G50.1" },
    Foreign { letter: b'G', tenths: (1010, 1010), control: "Haas", meaning: "mirror images on", instead: "write G51.1 with the axes and where they are mirrored, as G51.1 X0" },
    g(1070, "Haas", "cylindrical mapping", FIXED),
    Foreign { letter: b'G', tenths: (1100, 1290), control: "Haas", meaning: "work coordinate systems 7 to 26; on Siemens G110 to G112: poles", instead: "write G154 P1 to P20" },
    g(1500, "Haas, FANUC", "pocket cycle, or tool compensation off in the normal direction", LINES),
    g(1530, "Siemens", "machine coordinates for one block", "write G53"),
    g(1740, "Haas", "rigid tapping to the left, not upright", "use G74"),
    g(1840, "Haas", "rigid tapping, not upright", "use G84"),
    g(2900, "Siemens", "turns the Siemens language on", "hand in a program in ISO code"),
    g(2910, "Siemens", "turns the ISO language on", OUT),
    g(5000, "Siemens", "work coordinate systems off", "write G53 in each block that needs it"),
    Foreign { letter: b'G', tenths: (5050, 5990), control: "Siemens", meaning: "work coordinate systems 5 to 99", instead: "use G54 to G59.3" },
    Foreign { letter: b'G', tenths: (6010, 6030), control: "Siemens", meaning: "how exact a stop is", instead: "write G61.1, or leave it out" },
    g(6410, "Siemens", "rounds corners within a distance", "use G64 P"),
    g(6420, "Siemens", "rounds corners within the axes' tolerances", "use G64 P"),

    m(10, "many controls", "clamps an axis or the work", CHECK),
    m(11, "many controls", "unclamps an axis or the work", CHECK),
    ms(12, 13, "Haas and others", "clamps or unclamps a rotary axis, or air", CHECK),
    m(13, "many controls", "spindle clockwise and coolant", "write M3 M8"),
    m(14, "many controls", "spindle counter-clockwise and coolant; clamps an axis", "write M4 M8"),
    ms(15, 16, "builders of machines", "clamps, chip conveyor or tool magazine", CHECK),
    m(17, "Siemens, FANUC lathes", "ends a subprogram; turns the turret", "write M99 for the end of a subprogram"),
    m(18, "Okuma, 3D printers", "ends the spindle's orientation; motors off", OUT),
    m(20, "FANUC, Heidenhain", "a function of the machine's builder; on 3D printers: lists files", CHECK),
    ms(21, 28, "builders of machines", "functions of the machine: mirror images, tailstock, doors, chamfers of threads", CHECK),
    ms(31, 36, "builders of machines", "chip conveyor, parts catcher, door", CHECK),
    ms(37, 39, "builders of machines", "doors, or ranges of the spindle's speed", CHECK),
    ms(40, 46, "many controls", "gears of the spindle", "set the gear by hand, or leave it out if the machine has one"),
    m(47, "Mach3, FANUC", "runs the program from its beginning again", "write the repetition as a loop, as o100 repeat [5]"),
    ms(54, 59, "builders of machines", "functions of the machine; M56 of grbl: parks", CHECK),
    m(69, "builders of machines", "clamps, mirror images, modes", CHECK),
    ms(74, 79, "builders of machines", "clamps, mirror images, modes", CHECK),
    ms(80, 81, "3D printers", "power on or off; of machine tools: doors", CHECK),
    ms(82, 86, "3D printers", "the extruder's distance mode, motors off", PRINTER),
    ms(87, 89, "builders of machines", "coolant through the spindle, air", CHECK),
    ms(90, 95, "builders of machines", "modes of the machine", CHECK),
    m(96, "Haas, FANUC", "jumps when an input is off, or interrupts by macro", "write IF [...] GOTO"),
    ms(104, 105, "3D printers", "heats the extruder", PRINTER),
    ms(106, 107, "3D printers, lasers", "fan or laser on and off", "write M3 S and M5 for a laser; of a printer no machine tool can run the program"),
    ms(109, 109, "3D printers", "heats the extruder and waits", PRINTER),
    ms(108, 116, "3D printers", "waits, or tells what the printer is", PRINTER),
    m(117, "3D printers", "shows a message", "write (MSG, the text)"),
    ms(140, 141, "3D printers", "heats the bed or the chamber", PRINTER),
    m(190, "3D printers", "heats the bed and waits", PRINTER),
    m(198, "FANUC", "calls a subprogram in the memory card", "write M98, and put the subprogram into a file beside the program"),
    ms(200, 209, "3D printers", "filament, accelerations, steps a mm", "leave it out: the machine profile holds what the axes can do"),
    ms(210, 219, "3D printers", "settings of the printer", PRINTER),
    ms(220, 221, "3D printers, senders", "speed or flow in percent", "leave it out, and write F in the speeds that are meant; --lenient leaves out M220 S100"),
    ms(222, 599, "3D printers", "settings of the printer", PRINTER),
    ms(600, 999, "builders of machines, 3D printers", "functions of the machine", CHECK),
];

/// How lines of other languages begin, or what stands in them: upper case, blanks as one.
const LANGUAGES: &[(&str, &str)] = &[
    ("BEGIN PGM", HEIDENHAIN),
    ("END PGM", HEIDENHAIN),
    ("TOOL CALL", HEIDENHAIN),
    ("TOOL DEF", HEIDENHAIN),
    ("BLK FORM", HEIDENHAIN),
    ("CYCL DEF", HEIDENHAIN),
    ("CYCL CALL", HEIDENHAIN),
    ("CC X", HEIDENHAIN),
    ("L X", HEIDENHAIN),
    ("L Y", HEIDENHAIN),
    ("L Z", HEIDENHAIN),
    ("L IX", HEIDENHAIN),
    ("FN 0:", HEIDENHAIN),
    ("LBL ", HEIDENHAIN),
    ("DEF REAL", SIEMENS),
    ("DEF INT", SIEMENS),
    ("MCALL", SIEMENS),
    ("CYCLE8", SIEMENS),
    ("CYCLE9", SIEMENS),
    ("POCKET3", SIEMENS),
    ("WORKPIECE(", SIEMENS),
    ("MSG(", SIEMENS),
    ("TRANS", SIEMENS),
    ("ATRANS", SIEMENS),
    ("GOTOF", SIEMENS),
    ("GOTOB", SIEMENS),
    ("VC1=", OKUMA),
    ("MODIN", OKUMA),
    ("CALL O", OKUMA),
    ("FEDRAT/", APT),
    ("GOTO/", APT),
    ("PARTNO", APT),
    ("LOADTL/", APT),
    ("IN;", HPGL),
    ("PU;", HPGL),
    ("PD;", HPGL),
    ("<?XML", "XML"),
    ("<HTML", "a web page"),
    ("<!DOCTYPE", "a web page"),
    ("SOLID ", "an STL model"),
    ("ISO-10303-21", "a STEP model"),
    ("SECTION", "a DXF drawing"),
];

/// Files that are no NC programs of any control.
const NO_PROGRAMS: &[&str] =
    &[APT, HPGL, "XML", "a web page", "an STL model", "a STEP model", "a DXF drawing"];

const HEIDENHAIN: &str = "Heidenhain's conversational language";
const SIEMENS: &str = "Siemens' own language";
const OKUMA: &str = "Okuma's own language";
const APT: &str = "APT, from before the post processor";
const HPGL: &str = "HPGL, for a plotter";

/// The fault of a line that is written in another language, if it is known: it says more than those
/// of its words.
pub(super) fn language(line: &[u8]) -> Option<Fault> {
    let text = String::from_utf8_lossy(line).to_ascii_uppercase();
    let words: Vec<&str> = text.split_whitespace().collect();
    let text = words.join(" ");
    // A number of the block may stand before.
    let begins = text.trim_start_matches(|c: char| c == 'N' || c.is_ascii_digit()).trim_start();
    let begins_with = |start: &str| text.starts_with(start) || begins.starts_with(start);
    let known =
        LANGUAGES.iter().find(|(start, _)| begins_with(start)).map(|(_, language)| *language);
    let language = known.or_else(|| sets_by_letters(&text).then_some(SIEMENS))?;
    let start = line.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(0);
    let (start, end) = (start as u32, line.len() as u32);
    if NO_PROGRAMS.contains(&language) {
        let fault = Fault::new(&rules::NOT_TEXT, start, end, format!("this is {language}"));
        return Some(fault.help("hand in the NC program that was made from it"));
    }
    let message = format!("this line is {language}");
    let fault = Fault::new(&rules::UNSUPPORTED_WORD, start, end, message);
    Some(fault.help("let the post processor put out ISO code (G and M words)"))
}

/// Whether a value is given as in `R1=5` or `X=R1`, and not to a parameter `#1`, nor by the command
/// of a sender, as `$J=X1`.
fn sets_by_letters(text: &str) -> bool {
    let Some((before, _)) = text.split_once('=').filter(|_| !text.contains(['#', '(', '$'])) else {
        return false;
    };
    before
        .trim_end_matches(|c: char| c.is_ascii_digit())
        .ends_with(|c: char| c.is_ascii_alphabetic())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gcode::codes;

    /// But for M100 to M199, which are the user's here.
    #[test]
    fn what_is_foreign_is_no_code_of_ours() {
        for row in FOREIGN.iter().filter(|row| row.tenths.0 == row.tenths.1) {
            let number = f64::from(row.tenths.0) / 10.0;
            let own = codes::find(row.letter, number);
            let is_users = row.letter == b'M' && (100.0..200.0).contains(&number);
            assert!(own.is_none() || is_users, "{} is in both tables", row.name());
        }
    }

    #[test]
    fn codes_of_others_are_found_by_their_numbers() {
        let name = |letter, number| find(letter, number).map(Foreign::name);
        assert_eq!(name(b'M', 104.0).as_deref(), Some("M104 to M105"));
        assert_eq!(name(b'G', 68.2).as_deref(), Some("G68.2"));
        assert_eq!(name(b'M', 10.0).as_deref(), Some("M10"));
        for (letter, number) in [(b'G', 5.75), (b'G', -1.0), (b'M', 1e9), (b'G', 999.0)] {
            assert_eq!(name(letter, number), None, "{number}");
        }
    }
}
