// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

/// @file
/// Smoothing and differentiation of logs without delay (Hayat et al. 2022, section 4.4.3.2).

namespace kr5::identification {

/// Zero-phase Butterworth low-pass of each column: the filter runs forward and backward, so that its gain is squared
/// (a half at the cut-off) and its delay none. Before filtering a column is continued beyond its ends by its reflection
/// in the end point, and the filter starts in the state of a constant of the first value, which it has forgotten before
/// the first sample: constants come out unchanged, and straight lines to about 1e-4 of their rise over a period of the
/// cut-off.
/// @param values Samples x channels at even steps, at least two; @param step Time between samples [s];
/// @param cutoff Half-power frequency of one pass, below half the sampling rate [Hz]; @param order 1 to 12.
/// @throws InvalidArgument naming the argument.
Eigen::MatrixXd zero_phase_low_pass(const Eigen::Ref<const Eigen::MatrixXd>& values, double step, double cutoff,
                                    int order = 4);

/// First derivative of each column by central differences; at both ends by the parabola through three samples.
/// @param values Samples x channels at even steps, at least three; @param step [s].
Eigen::MatrixXd central_differences(const Eigen::Ref<const Eigen::MatrixXd>& values, double step);

/// Second derivative of each column by the difference of neighbouring differences; at the ends, that of the neighbour.
/// @param values Samples x channels at even steps, at least three; @param step [s].
Eigen::MatrixXd second_differences(const Eigen::Ref<const Eigen::MatrixXd>& values, double step);

}  // namespace kr5::identification
