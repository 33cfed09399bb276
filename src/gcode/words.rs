//! What words mean that are no codes: the letters of a block, and the signs that may stand in one.
//! Nothing is executed by this table; explanations and the reference read it.

/// A letter or sign and what it means.
#[derive(Debug, PartialEq, Eq)]
pub struct WordMeaning {
    /// As it is written: `F`, `GR`, `,R`.
    pub name: &'static str,
    /// One sentence on what it means.
    pub meaning: &'static str,
    /// A block that has it.
    pub example: &'static str,
}

const fn w(name: &'static str, meaning: &'static str, example: &'static str) -> WordMeaning {
    WordMeaning { name, meaning, example }
}

/// The table.
#[rustfmt::skip]
pub static WORDS: &[WordMeaning] = &[
    w("GR", "calls the subprogram of that number, L times; its number stands behind GR or in P", "GR100 L2"),
    w("O", "the number of a program, or the label of a loop, a condition or a subprogram", "O100"),
    w("N", "the number of a block: where GOTO, M99 P and cycles of lathes lead", "N10 G0 X5"),
    w("X Y Z", "positions (G90) or distances (G91) along the axes, in the units in force", "G0 X10 Y20 Z5"),
    w("A B C", "positions or distances about the axes that turn, in degrees", "G1 A90 F360"),
    w("U V W", "positions or distances along further axes; of FANUC-style lathes distances along X, Y and Z", "G1 U5 W-2"),
    w("I J K", "from the start of an arc to its centre along X, Y and Z; what else they are hangs on the code", "G2 X10 I5"),
    w("R", "the radius of an arc, the level of a canned cycle; what else hangs on the code", "G3 X10 R5"),
    w("F", "the feed: mm or inches a minute (G94) or a turn (G95), or one over the minutes of the move (G93); of threads of lathes the lead", "G1 X10 F200"),
    w("S", "the spindle's speed: turns a minute, or under G96 metres or feet a minute", "M3 S1000"),
    w("T", "the tool that M6 puts into the spindle; of FANUC-style lathes the tool and its offset, which change at once", "T3 M6"),
    w("D", "the tool whose radius G41 and G42 take, the diameter itself for G41.1 and G42.1; the greatest speed of G96", "G41 D3"),
    w("H", "the tool whose length G43 takes", "G43 H3"),
    w("E", "the taper of G76, the number of an analog output or input; of 3D printers the extruder, which is refused", "M68 E0 Q1.5"),
    w("P", "the time of a dwell, the number of a subprogram; what else hangs on the code", "G4 P0.5"),
    w("Q", "the depth of a peck; what else hangs on the code", "G83 X5 Z-20 R2 Q3"),
    w("L", "how often a cycle or a call is repeated; what G10 sets", "M98 P100 L3"),
    w(",C", "a chamfer between this line and the next, which begins and ends so far from the corner", "G1 X20 ,C2"),
    w(",R", "a fillet between this move and the next, of that radius", "G1 X20 ,R5"),
    w(",A", "the angle of a line from the first axis of the plane on, in the place of one coordinate of its end or of both", "G1 X20 ,A30"),
    w("@ ^", "radius and angle of polar coordinates, in the place of X and Y", "G0 @10 ^45"),
    w("$", "the number of the spindle: 0 or -1", "M3 S1000 $0"),
    w("/", "at the beginning of a line: --block-delete leaves the line out", "/G0 X5"),
    w("%", "the beginning and the end of the program's text", "%"),
    w("*", "the end of a block", "G0 X5 *"),
];

/// The row of a name, in either case; of a row of several, each of them.
pub fn find(name: &str) -> Option<&'static WordMeaning> {
    let is_of = |row: &&WordMeaning| row.name.split(' ').any(|own| own.eq_ignore_ascii_case(name));
    WORDS.iter().find(is_of)
}
