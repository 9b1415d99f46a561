// A value with one owner, of which others may hold what it was at some moment.
#pragma once

#include <memory>
#include <utility>

#include "base/structures/former_holders.h"

namespace lodestone {

// A snapshot is never changed: the owner copies the value before it writes while a snapshot is held. Taking one costs
// nothing, and where none is held at the time of writing nothing is ever copied.
template <class T>
class CopyOnWrite {
public:
    explicit CopyOnWrite(T value) : value_(std::make_shared<T>(std::move(value))) {}
    const T& operator*() const { return *value_; }
    const T* operator->() const { return value_.get(); }
    T& write() {
        if (value_.use_count() > 1) value_ = std::make_shared<T>(*value_);
        synchronise_with_former_holders(value_);
        return *value_;
    }
    std::shared_ptr<const T> snapshot() const { return value_; }

private:
    std::shared_ptr<T> value_;
};

}  // namespace lodestone
