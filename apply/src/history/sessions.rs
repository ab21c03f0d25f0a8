//! What a history is made from: the parameters of one machine in each of its sessions.

use abbe_trace::validate::ValidationVerdict;

/// The sessions of one machine.
#[derive(Clone, Debug, Default)]
pub struct MachineSessions {
    /// Identifier of the machine.
    pub machine_id: String,
    /// Its name.
    pub name: String,
    /// Its structural code.
    pub code: String,
    /// The parameters: identifier, unit, meaning.
    pub parameters: Vec<(String, String, String)>,
    /// The parameters that are held at nominal, so that the others have values: those of a base parametrisation.
    pub held_at_nominal: Vec<String>,
    /// Number of directions of the parameters of the machine that the latest session determines.
    pub determined: usize,
    /// What a validation says of the latest session, if it was validated and the model does not hold.
    pub validation: Option<ValidationVerdict>,
    /// The sessions by time.
    pub sessions: Vec<SessionValues>,
}

/// The parameters of a machine in one session.
#[derive(Clone, Debug, Default)]
pub struct SessionValues {
    /// Days since an epoch.
    pub days: f64,
    /// The latest time that its date can mean: a date without a time is a whole day.
    pub until_days: f64,
    /// The session.
    pub file: String,
    /// Value and standard uncertainty of each parameter of the machine; `None` where the session does not identify it.
    pub values: Vec<Option<(f64, f64)>>,
    /// Covariance of the parameters; entries of missing ones do not count.
    pub covariance: Vec<Vec<f64>>,
}
