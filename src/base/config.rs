//! The text of a `cnc.toml` → [`Config`]: what a computer or a folder has, apart from machines.
//!
//! An unknown key is an error, with what was meant. Which files there are, and whose value wins, is
//! not known here, beyond [`Config::over`].

use std::collections::BTreeMap;

use crate::base::Diagnostic;
use crate::base::machine::keys::Keys;

/// What `color` may say.
const COLORS: [&str; 3] = ["auto", "always", "never"];

/// What a file or several say.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Config {
    /// Defaults of options, by the option's name (`max_errors` for `--max-errors`).
    pub settings: BTreeMap<&'static str, Setting>,
    /// `[ports.NAME]`: ports by names of the user's.
    pub ports: BTreeMap<String, PortConfig>,
}

/// The default of an option.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// As it would stand on the command line.
    pub value: String,
    /// The file that says so.
    pub file: String,
    /// Its line, from 1.
    pub line: u32,
}

/// How to open a port. What is not said is left to the machine profile, or to the system.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PortConfig {
    /// A path or `usb:VID:PID[:SERIAL]`.
    pub device: Option<String>,
    /// Bits a second.
    pub baud: Option<u32>,
    /// How long to wait for an answer beyond the time of wire and tick.
    pub reply_timeout_ms: Option<u32>,
    /// How long the adapter may keep received bytes back.
    pub latency_timer_ms: Option<u32>,
    /// Most bytes handed to the port at a time.
    pub write_piece_bytes: Option<u32>,
}

impl Config {
    /// Reads the text of a file of this name, with the dialects that programs may be written in.
    ///
    /// # Errors
    /// All that is wrong with it, each with its place.
    pub fn parse(
        file: &str,
        text: &str,
        dialects: &[&'static str],
    ) -> Result<Config, Vec<Diagnostic>> {
        let mut keys = Keys::parse(text);
        let said = [
            ("machine", keys.string_if("machine")),
            ("dialect", word(&mut keys, "dialect", dialects)),
            ("color", word(&mut keys, "color", &COLORS)),
            ("max_errors", keys.integer_if("max_errors", 0..=1_000_000).map(|n| n.to_string())),
            ("no_input", keys.boolean_if("no_input").map(|is| is.to_string())),
        ];
        let settings = said.into_iter().filter_map(|(key, value)| {
            let line = keys.line(key)?;
            Some((key, Setting { value: value?, file: file.to_owned(), line }))
        });
        let settings = settings.collect();
        let names = keys.names("ports");
        let ports = names.into_iter().map(|name| (name.clone(), port(&mut keys, &name))).collect();
        keys.check_complete();
        let faults = keys.into_faults();
        if faults.is_empty() { Ok(Config { settings, ports }) } else { Err(faults) }
    }

    /// This, and where it says nothing what another one says, key by key.
    pub fn over(mut self, other: Config) -> Config {
        for (key, setting) in other.settings {
            self.settings.entry(key).or_insert(setting);
        }
        for (name, port) in other.ports {
            let nearer = self.ports.remove(&name).unwrap_or_default();
            self.ports.insert(name, nearer.over(port));
        }
        self
    }
}

impl PortConfig {
    /// This, and where it says nothing what another one says.
    pub fn over(self, other: PortConfig) -> PortConfig {
        PortConfig {
            device: self.device.or(other.device),
            baud: self.baud.or(other.baud),
            reply_timeout_ms: self.reply_timeout_ms.or(other.reply_timeout_ms),
            latency_timer_ms: self.latency_timer_ms.or(other.latency_timer_ms),
            write_piece_bytes: self.write_piece_bytes.or(other.write_piece_bytes),
        }
    }
}

/// One of some words, if the key is there.
fn word(keys: &mut Keys<'_>, path: &str, of: &[&'static str]) -> Option<String> {
    let words: Vec<(&str, Option<&str>)> = of.iter().map(|word| (*word, Some(*word))).collect();
    keys.choice(path, &words, Some(None)).map(str::to_owned)
}

fn port(keys: &mut Keys<'_>, name: &str) -> PortConfig {
    let table = format!("ports.{name}");
    if !keys.has_table(&table) {
        return PortConfig::default();
    }
    PortConfig {
        device: keys.string_if(&format!("{table}.device")),
        baud: keys.integer_if(&format!("{table}.baud"), 300..=10_000_000),
        reply_timeout_ms: keys.integer_if(&format!("{table}.reply_timeout_ms"), 1..=60_000),
        latency_timer_ms: keys.integer_if(&format!("{table}.latency_timer_ms"), 1..=255),
        write_piece_bytes: keys.integer_if(&format!("{table}.write_piece_bytes"), 1..=4096),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Config, Vec<Diagnostic>> {
        Config::parse("cnc.toml", text, &["iso", "fanuc"])
    }

    #[test]
    fn defaults_are_read_with_their_lines() {
        let near = parse("machine = \"router\"\nmax_errors = 5").unwrap();
        let both = near.over(parse("# mine\nno_input = true\nmachine = \"kimm\"").unwrap());
        let said = both.settings.iter().map(|(key, s)| (*key, s.value.as_str(), s.line));
        let expected = [("machine", "router", 1), ("max_errors", "5", 2), ("no_input", "true", 2)];
        assert_eq!(said.collect::<Vec<_>>(), expected);
    }

    #[test]
    fn ports_are_read_and_the_nearer_file_wins() {
        let near = "[ports.mill]\nbaud = 19200\n[ports.lathe]\ndevice = \"/dev/ttyS1\"";
        let far = "[ports.mill]\ndevice = \"usb:0403:6001\"\nbaud = 38400\nreply_timeout_ms = 500\n\
                   latency_timer_ms = 1\nwrite_piece_bytes = 16";
        let both = parse(near).unwrap().over(parse(far).unwrap());
        assert_eq!(both.ports.keys().collect::<Vec<_>>(), ["lathe", "mill"]);
        let mill = PortConfig {
            device: Some("usb:0403:6001".to_owned()),
            baud: Some(19_200),
            reply_timeout_ms: Some(500),
            latency_timer_ms: Some(1),
            write_piece_bytes: Some(16),
        };
        assert_eq!(both.ports["mill"], mill);
        assert_eq!(parse(""), Ok(Config::default()));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let check = |text: &str, line: u32, expected: &str| {
            let faults = parse(text).unwrap_err();
            let said = format!("{} {}", faults[0].message, faults[0].help.as_deref().unwrap_or(""));
            assert!(said.contains(expected), "{text}: {said}");
            assert_eq!(faults[0].span.line, line, "{text}");
        };
        check("[port.mill]", 1, "did you mean 'ports'");
        check("[ports.mill]\nbuad = 9600", 2, "did you mean 'baud'");
        check("[ports.mill]\nbaud = 9", 2, "from 300");
        check("[ports.mill]\ndevice = 7", 2, "a string in quotes");
        check("ports = 1", 1, "a table is expected");
        check("[ports]\nmill = \"/dev/ttyUSB0\"", 2, "a table is expected");
        check("[ports.\"a.b\"]", 1, "holds a dot");
        check("[ports", 1, "");
        check("machne = \"router\"", 1, "did you mean 'machine'");
        check("dialect = \"fanuk\"", 1, "did you mean \"fanuc\"");
        check("\ncolor = true", 2, "a string in quotes");
        check("no_input = 1", 1, "true or false");
    }
}
