//! Lines and the blocks that they become, and what is wrong with them.

use proptest::prelude::*;

use super::*;

fn read(line: &[u8]) -> (Block, Vec<&'static str>) {
    let (mut block, mut faults) = (Block::default(), Vec::new());
    parse(line, &mut block, &mut faults);
    (block, faults.iter().map(|fault| fault.rule.name).collect())
}

/// Hands out so many bytes at a time.
struct Pieces<'a> {
    text: &'a [u8],
    bytes: usize,
}

impl Read for Pieces<'_> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let (piece, rest) = self.text.split_at(self.bytes.min(self.text.len()));
        out[..piece.len()].copy_from_slice(piece);
        self.text = rest;
        Ok(piece.len())
    }
}

fn check(line: &str, canonical: &str, faults: &[&str]) {
    let (block, found) = read(line.as_bytes());
    assert_eq!((block.to_string().as_str(), found.as_slice()), (canonical, faults), "{line}");
}

#[test]
fn lines_become_words() {
    check("", "", &[]);
    check("N001 G00 X2.0 Y0.0 F1000 *", "N1 G0 X2 Y0 F1000", &[]);
    check("n10g1x1y-.5;end", "N10 G1 X1 Y-0.5", &[]);
    check("g 0 x +0. 12 34 y 7", "G0 X0.1234 Y7", &[]);
    check("(a) G1 (b;c) X1 (d)", "G1 X1", &[]);
    check("/ N5 G4 P.5", "/N5 G4 P0.5", &[]);
    check(":1000", "O1000", &[]);
    check("O0008 (Test program)", "O8", &[]);
    check("<O0008> (Test program)", "O8", &[]);
    check("<Part 1>", "O<part1>", &[]);
    check("/2 N5 G4", "/N5 G4", &[]);
    check("N5 / G4", "/N5 G4", &[]);
    check("/22 G4", "/G4", &["bad-number"]);
    check("% ; tape", "%", &[]);
    check("/%", "/%", &[]);
    check("GR100", "GR100", &[]);
    check("N7 g r P100 L2", "GR N7 P100 L2", &[]);
    check("O5 GR100", "GR100 O5", &[]);
    check("G1 (\u{e4}\u{f6}) X1", "G1 X1", &[]);
    check("x#1 y-#<A b>z[1+2]", "X#1 Y-#<ab> Z[1 + 2]", &[]);
    check("#1=2+3 ##2=#1 *", "#1=2 + 3 ##2=#1", &[]);
    check("N5 o<Name> call [1] [#2]", "N5 O<name> CALL [1] [#2]", &[]);
    check("o 10 while[#1 lt 5](c)", "O10 WHILE [#1 LT 5]", &[]);
    check("IF[#1EQ2]GOTO10", "IF [#1 EQ 2] GOTO [10]", &[]);
    check("IF [#1] THEN #2=3", "IF [#1] THEN #2=3", &[]);
    check("N7 WHILE [1] DO2", "N7 WHILE [1] DO2", &[]);
    check("END2", "END2", &[]);
    check("G X COS[0]", "X[COS[0]]", &["missing-number"]);
    check("G0 @ 5 ^-30 S100 $0", "G0 @5 ^-30 S100 $0", &[]);
    check("o#1 call [2]", "O#1 CALL [2]", &[]);
    check("X#<_ini[a]b> Y1", "X#<_ini[a]b> Y1", &[]);
    check("G[ROUND[1]] X[5] YROUND[2] Z-[-#1]", "G[ROUND[1]] X[5] Y[ROUND[2]] Z[--#1]", &[]);
    let deep = format!("X{}2 #1={}#1", "#".repeat(63), "-".repeat(62));
    check(&deep, &deep, &[]);
    let long = format!("X[1{}]", " + 1".repeat(100));
    check(&long, &long, &[]);
    check("G65 P1 I1 K2 I3", "G65 P1 I1 K2 I3", &[]);
}

#[test]
fn faults_are_named_and_the_rest_of_the_words_is_read() {
    check("G1 X Y2 Z", "G1 Y2", &["missing-number", "missing-number"]);
    check("X1 X2 Y3", "X1 Y3", &["repeated-word"]);
    check("X1.2.3", "X1.2", &["bad-number"]);
    check("X--1", "", &["bad-number"]);
    check("X9999999999", "", &["bad-number"]);
    check("G1 (open", "G1", &["open-comment"]);
    check("G1 (a(b)c) X1", "G1 X1", &["nested-comment"]);
    check("G1 (a(b) X1", "G1 X1", &["nested-comment"]);
    check("G1 X1,5 Y-2,25Z", "G1 X1 Y-2", &["decimal-comma", "decimal-comma", "missing-number"]);
    check("X[1,5] Y2", "", &["decimal-comma"]);
    check("G1 X1, Y2,C3", "G1 X1 Y2 ,C3", &["bad-character"]);
    check("G1 X1 ,c3 , r.5,A", "G1 X1 ,C3 ,R0.5", &["missing-number"]);
    check("G1 X\u{2212}5\u{a0}Y\u{2212}1", "G1", &["look-alike", "look-alike", "look-alike"]);
    check("G\u{ff11} \u{425}10 Y5", "Y5", &["look-alike", "look-alike"]);
    check("G1 *X1", "G1", &["bad-character"]);
    check("G0 X1O5 Y1O", "G0 X1", &["look-alike", "look-alike"]);
    check("N10O100 X1 O5", "N10 O100 X1", &["repeated-word"]);
    check("% G1", "%", &["bad-character"]);
    check("G1 X#", "G1", &["expression"]);
    check("#1 5", "", &["expression"]);
    check("#1=", "", &["expression"]);
    check("X1 ] Y2", "X1", &["expression"]);
    check("IF [#1] X5", "", &["expression"]);
    check("IF [#1] THEN", "IF [#1] THEN", &["expression"]);
    check("X5 o1 endif", "X5 O1 ENDIF", &["call-alone"]);
    check("o<a", "", &["expression"]);
    check("o<a> 5", "", &["expression"]);
    check("o1 call [1] (a) [2] (MSG,b)", "O1 CALL [1] [2]", &[]);
    check("o1 call [1] (MSG,a) [2]", "O1 CALL [1]", &["expression"]);
    check("o1 sb", "", &["expression"]);
    check("o#1 if [1]", "", &["expression"]);
    check("$H", "", &["unsupported-word"]);
    check("$J=G91 X1", "", &["unsupported-word"]);
    check("G1 \u{e9}", "G1", &["bad-character"]);
    check("G1 \u{0}", "", &["not-text"]);
    check("!? X Y \u{7f}", "", &["not-text"]);
    check("(\u{1})", "", &["not-text"]);
    check("1 2", "", &["bad-number", "bad-number"]);
    check("G1 / X1", "G1", &["bad-character"]);
}

#[test]
fn words_know_their_place() {
    let (block, _) = read(b"  G1 x 1 5 Y2");
    let places: Vec<_> = block.words().iter().map(|word| (word.start, word.end)).collect();
    assert_eq!(places, [(2, 4), (5, 10), (11, 13)]);
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        (-1_000_000_i32..1_000_000, 0_u8..7)
            .prop_map(|(mantissa, decimals)| f64::from(mantissa) / 10_f64.powi(decimals.into())),
        -1e9..1e9_f64,
    ]
}

fn parameter() -> impl Strategy<Value = String> {
    prop_oneof!["#[1-9]", "##[1-9]", "#<[a-z]{1,3}>", expression().prop_map(|e| format!("#[{e}]"))]
}

/// An expression with more brackets, signs and blanks than it needs.
fn expression() -> impl Strategy<Value = String> {
    let leaf = prop_oneof!["[0-9]{1,3}\\.?[0-9]?", "#[1-9]", "# <a b>", "EXISTS\\[#<a>\\]"];
    leaf.prop_recursive(5, 24, 3, |inner| {
        let operators = "\\*\\*| ?[-+*/] ?| MOD |EQ|NE|GT|ge|LT|LE| AND | or |XOR";
        let functions = "ABS|ACOS|ASIN|COS|EXP|FIX|FUP|LN|round|SIN|SQRT|TAN";
        let inner = (inner, "[-+]?").prop_map(|(value, sign)| sign + &value);
        let inner = inner.boxed();
        prop_oneof![
            inner.clone().prop_map(|e| format!("[{e}]")),
            (inner.clone(), operators, inner.clone()).prop_map(|(a, op, b)| a + &op + &b),
            (functions, inner.clone()).prop_map(|(function, e)| format!("{function}[{e}]")),
            (inner.clone(), inner.clone()).prop_map(|(a, b)| format!("ATAN[{a}]/[{b}]")),
            inner.prop_map(|e| format!("#[{e}]")),
        ]
    })
}

/// What may stand behind a letter.
fn value() -> impl Strategy<Value = String> {
    let brackets = expression().prop_map(|e| format!("[{e}]"));
    prop_oneof![any_number().prop_map(|number| number.to_string()), parameter(), brackets]
        .prop_flat_map(|value| "[-+]?".prop_map(move |sign| sign + &value))
}

fn statement() -> impl Strategy<Value = String> {
    let keywords = "sub|endsub|return|call|if|elseif|else|endif|while|endwhile|do|repeat|endrepeat|\
                    break|continue";
    let values = || {
        proptest::collection::vec(expression(), 0..3)
            .prop_map(|list| list.into_iter().map(|e| format!(" [{e}]")).collect::<String>())
    };
    prop_oneof![
        ("o(<a>|7)", keywords, values())
            .prop_map(|(label, keyword, e)| label + " " + &keyword + &e),
        (value(), values()).prop_map(|(number, e)| format!("o{number} call{e}")),
        value().prop_map(|target| format!("GOTO{target}")),
        (expression(), value()).prop_map(|(e, target)| format!("IF [{e}] GOTO {target}")),
        expression().prop_map(|e| format!("IF [{e}] THEN")),
        expression().prop_map(|e| format!("WHILE [{e}] DO2")),
        "(DO|END)[1-3]",
    ]
}

proptest! {
    #[test]
    fn a_printed_block_reads_back(
        words in proptest::collection::vec(("[A-Z]", any_number()), 0..12),
        delete: bool,
    ) {
        let mut line = String::from(if delete { "/" } else { "" });
        for (letter, value) in words {
            line += &format!("{letter}{value} ");
        }
        let (block, _) = read(line.as_bytes());
        let (again, faults) = read(block.to_string().as_bytes());
        prop_assert_eq!(faults.len(), 0);
        prop_assert_eq!(block, again);
    }

    #[test]
    fn a_printed_line_reads_back(
        words in proptest::collection::vec(("[A-MP-Z@^]", value()), 0..4),
        statement in proptest::option::of(statement()),
        sets in proptest::collection::vec((parameter(), expression()), 0..3),
    ) {
        let mut line: Vec<String> = match statement {
            Some(statement) => vec![statement],
            None => words.into_iter().map(|(letter, value)| letter + &value).collect(),
        };
        line.extend(sets.into_iter().map(|(parameter, value)| format!("{parameter}={value}")));
        let (block, faults) = read(line.join(" ").as_bytes());
        prop_assume!(faults.is_empty());
        let (again, faults) = read(block.to_string().as_bytes());
        prop_assert_eq!(faults.len(), 0, "{}", block);
        prop_assert_eq!(block, again);
    }

    /// Wherever what has been read of the text ends, each line is what it is by itself.
    #[test]
    fn lines_of_a_text_are_read_as_lines(
        lines in proptest::collection::vec(
            "(/|%| )?(N[0-9]{1,3} ?)?(G[0-3] ?)?(X-?[0-9]{0,9}\\.?[0-9]{0,9} {0,2}){0,2}\
             (Y#1|\\(a\\)|;b|\x1a|Z)?(\n|\r|\r\n)?",
            0..12,
        ),
        bytes in 1..60_usize,
    ) {
        let text = lines.concat();
        let mut one_by_one = Lines::new(text.as_bytes(), 0, 1);
        let mut all = Lines::new(Pieces { text: text.as_bytes(), bytes }, 0, 1);
        let (mut block, mut faults) = (Block::default(), Vec::new());
        loop {
            faults.clear();
            let line = parse_next(&mut all, &mut block, &mut faults).unwrap();
            prop_assert_eq!(line, one_by_one.next_line().unwrap());
            let Some(line) = line else { break };
            let (mut alone, mut faults_alone) = (Block::default(), Vec::new());
            parse(line.bytes, &mut alone, &mut faults_alone);
            prop_assert_eq!(format!("{:?}", block.words()), format!("{:?}", alone.words()));
            prop_assert_eq!(&block, &alone);
            prop_assert_eq!(format!("{faults:?}"), format!("{faults_alone:?}"));
        }
    }

    #[test]
    fn no_bytes_panic(line in proptest::collection::vec(any::<u8>(), 0..200)) {
        read(&line);
    }

    #[test]
    fn no_text_panics(line in "[GXYMORgrifendo<>=0-9.#%*/(); \\[\\]é-]{0,60}") {
        read(line.as_bytes());
    }
}
