#pragma once

#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>

#include <string>

namespace meshsmooth::formats {

class ComplaintWindow;

/// While it lives, it captures VTK's error messages, which otherwise go to the terminal. VTK's
/// readers report an error and carry on; the first one counts.
class CapturedErrors {
 public:
  CapturedErrors();
  ~CapturedErrors();
  CapturedErrors(const CapturedErrors&) = delete;
  CapturedErrors& operator=(const CapturedErrors&) = delete;

  /// The first one in one line, without VTK's source file and address; or "".
  [[nodiscard]] std::string first() const;

 private:
  vtkSmartPointer<ComplaintWindow> window_;
  vtkSmartPointer<vtkOutputWindow> before_;
  vtkLogger::Verbosity verbosity_before_;
};

}  // namespace meshsmooth::formats
