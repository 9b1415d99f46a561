// Holds a frame time by moving the pixel error: scalability at run time.
//
// The cost of a frame falls about as a power of the error. So every frame, told what it took and at which error it was
// drawn, says which error would have hit the target if the power were as steep as it gets; the controller moves a part
// of the way to the median of what the last frames say. As each frame is judged by the error it was drawn with, frames
// under way do no harm; where costs fall less steeply, the way is only made in more steps. So it neither overshoots nor
// swings, single slow frames are passed over, and near enough is left alone: what holds its time does not change.
#pragma once

#include <array>
#include <cstdint>

namespace lodestone {

// Holds a frame time. One for each flight or viewer.
class ErrorController {
public:
    // Between which the error stays.
    struct Range {
        double least = 1.0 / 16, most = 64;  // pixels, 0 < least <= most
    };
    // target_ms > 0: what a frame may take. error: to begin with, pixels, brought into the range.
    explicit ErrorController(double target_ms, double error = 1) : ErrorController(target_ms, error, Range{}) {}
    // The same within another range.
    ErrorController(double target_ms, double error, const Range& range);

    double error() const { return error_; }          // for the next frame, pixels
    double target_ms() const { return target_ms_; }  // what a frame may take, milliseconds
    // What a recent frame took, > 0, and its pixel error.
    void record(double ms, double error);
    // A new target; the error goes on from where it is.
    void aim(double target_ms);

private:
    double target_ms_, error_;
    Range range_;
    std::array<double, 5> recent_{};  // logarithms of the cost at an error of 1, if it were steep
    uint32_t frames_ = 0;
};

}  // namespace lodestone
