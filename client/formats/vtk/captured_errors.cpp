#include "vtk/captured_errors.hpp"

#include <vtkObjectFactory.h>

#include <algorithm>
#include <string_view>

namespace meshsmooth::formats {

class ComplaintWindow : public vtkOutputWindow {
 public:
  static ComplaintWindow* New();
  vtkTypeMacro(ComplaintWindow, vtkOutputWindow) void DisplayText(const char* text) override {
    note(text);
  }
  void DisplayErrorText(const char* text) override { note(text); }
  void DisplayWarningText(const char* text) override { note_if_serious(text); }
  void DisplayGenericWarningText(const char* text) override { note_if_serious(text); }
  void DisplayDebugText(const char*) override {}

  std::string first;

 private:
  // Some readers only warn of a file that ends too early.
  void note_if_serious(const char* text) {
    if (text != nullptr && std::string_view(text).find("rror") != std::string_view::npos)
      note(text);
  }
  void note(const char* text) {
    if (first.empty() && text != nullptr) first = text;
  }
};
vtkStandardNewMacro(ComplaintWindow);

CapturedErrors::CapturedErrors()
    : window_(vtkSmartPointer<ComplaintWindow>::New()),
      before_(vtkOutputWindow::GetInstance()),
      verbosity_before_(vtkLogger::GetCurrentVerbosityCutoff()) {
  vtkOutputWindow::SetInstance(window_);
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
}

CapturedErrors::~CapturedErrors() {
  vtkLogger::SetStderrVerbosity(verbosity_before_);
  vtkOutputWindow::SetInstance(before_);
}

std::string CapturedErrors::first() const {
  std::string text = window_->first;
  std::replace(text.begin(), text.end(), '\n', ' ');
  for (const char* sign : {"): ", ".cxx, line "}) {
    if (const auto place = text.find(sign); place != std::string::npos) {
      text.erase(0, place + std::string_view(sign).size());
    }
  }
  text.erase(text.find_last_not_of(" \t\r") + 1);
  return text;
}

}  // namespace meshsmooth::formats
