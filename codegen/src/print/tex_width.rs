//! Width of LaTeX mathematics in Computer Modern at 10 pt, from the widths of its glyphs and the spaces of TeX.
//!
//! The result is an upper estimate by a few per cent: italic corrections count in full, and a group in a subscript is
//! as wide as at 8 pt.

/// Points in a millimetre of TeX.
pub(crate) const POINTS_PER_MM: f64 = 72.27 / 25.4;

/// The width of a piece of an equation, 1/100 pt.
pub(crate) fn width(text: &str) -> usize {
    let characters: Vec<char> = text.chars().collect();
    Measure { characters: &characters, at: 0 }.until(None).round() as usize
}

struct Measure<'t> {
    characters: &'t [char],
    at: usize,
}

impl Measure<'_> {
    fn next(&mut self) -> Option<char> {
        let next = self.characters.get(self.at).copied();
        self.at += 1;
        next
    }

    fn peek(&self) -> Option<char> {
        self.characters.get(self.at).copied()
    }

    /// The width up to a closing brace, or of everything.
    fn until(&mut self, end: Option<char>) -> f64 {
        let (mut width, mut after_operand) = (0.0, false);
        while let Some(character) = self.next() {
            if Some(character) == end {
                break;
            }
            match character {
                ' ' | '\u{2062}' | '&' => continue,
                '_' | '^' => width += self.scripts(character) + 50.0,
                '+' | '-' if !after_operand => width += 778.0,
                '+' | '-' => width += 1222.0,
                '=' => width += 1333.0,
                '{' => width += self.until(Some('}')),
                '\\' => width += self.command(),
                other => width += letter(other),
            }
            after_operand = !matches!(character, '+' | '-' | '=' | '(');
        }
        width
    }

    /// The wider one of a subscript and a superscript.
    fn scripts(&mut self, first: char) -> f64 {
        let one = self.argument();
        match self.peek() {
            Some(second @ ('_' | '^')) if second != first => {
                self.at += 1;
                0.8 * one.max(self.argument())
            }
            _ => 0.8 * one,
        }
    }

    /// A group in braces, a command or a character.
    fn argument(&mut self) -> f64 {
        while self.peek() == Some(' ') {
            self.at += 1;
        }
        match self.next() {
            Some('{') => self.until(Some('}')),
            Some('\\') => self.command(),
            Some(other) => letter(other),
            None => 0.0,
        }
    }

    fn command(&mut self) -> f64 {
        let start = self.at;
        while self.peek().is_some_and(|c| c.is_ascii_alphabetic()) {
            self.at += 1;
        }
        let name: String = self.characters[start..self.at].iter().collect();
        match name.as_str() {
            // A control symbol: a space, a line break or an escaped character.
            "" => match self.next() {
                Some(' ') => 333.0,
                Some('\\' | '!') | None => 0.0,
                Some(',') => 167.0,
                Some(_) => 500.0,
            },
            "frac" => self.argument().max(self.argument()) + 240.0,
            "sqrt" => self.argument() + 1000.0,
            "mathrm" | "text" | "operatorname" => self.upright(),
            "bigl" | "bigr" => 60.0,
            "quad" => 1000.0,
            "qquad" => 2000.0,
            "notag" | "label" | "allowbreak" => 0.0,
            "approx" => 1333.0,
            "cdot" => 722.0,
            "times" => 1222.0,
            "partial" | "theta" | "delta" | "sigma" | "pi" | "mu" => 650.0,
            // An upright word with a thin space on either side.
            function => function.chars().map(letter).sum::<f64>() + 333.0,
        }
    }

    /// A group of upright text.
    fn upright(&mut self) -> f64 {
        self.argument() + if self.peek() == Some('(') { 0.0 } else { 100.0 }
    }
}

/// The width of a letter, the wider one of italic (with its correction) and upright.
fn letter(character: char) -> f64 {
    const CAPITALS: [u16; 26] = [
        750, 810, 787, 847, 796, 778, 786, 912, 518, 651, 920, 681, 1079, 912, 790, 781, 791, 773, 675, 722, 792, 806,
        1083, 907, 805, 755,
    ];
    const SMALL: [u16; 26] = [
        529, 556, 444, 556, 466, 597, 513, 576, 345, 469, 549, 318, 878, 600, 500, 556, 482, 479, 469, 392, 572, 528,
        743, 572, 528, 509,
    ];
    match character {
        'A'..='Z' => f64::from(CAPITALS[character as usize - 'A' as usize]),
        'a'..='z' => f64::from(SMALL[character as usize - 'a' as usize]),
        '0'..='9' | '/' => 500.0,
        '(' | ')' => 389.0,
        ',' => 445.0,
        '.' | ':' | '\'' => 278.0,
        _ => 780.0,
    }
}
