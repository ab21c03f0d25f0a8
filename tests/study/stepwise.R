# Forward stepwise regression with exact selective inference, by the package selectiveInference (Tibshirani, Taylor,
# Lockhart, Tibshirani: Exact post-selection inference for sequential regression procedures, JASA 111 (2016) 600).
# The first column of the file is the response, with white noise of standard deviation 1. Prints the p-values of five
# steps and the number of steps at which ForwardStop rejects with a false discovery rate of 1 %.
suppressPackageStartupMessages(library(selectiveInference))
table <- as.matrix(read.csv(commandArgs(trailingOnly = TRUE)[1], header = FALSE))
path <- fs(table[, -1], table[, 1], maxsteps = 5, intercept = FALSE, normalize = FALSE)
inference <- fsInf(path, sigma = 1)
cat(inference$pv, forwardStop(inference$pv, 0.01), "\n")
