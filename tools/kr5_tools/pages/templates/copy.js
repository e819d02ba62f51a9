// A button beside a text copies it: by the clipboard of the browser, which a page opened from a file may lack, else by
// a selection.
for (const button of document.querySelectorAll(".copyable button")) {
  button.addEventListener("click", async () => {
    const shown = button.previousElementSibling;
    let copied = false;
    try {
      await navigator.clipboard.writeText(shown.textContent);
      copied = true;
    } catch {
      const range = document.createRange();
      range.selectNodeContents(shown);
      const selection = getSelection();
      selection.removeAllRanges();
      selection.addRange(range);
      copied = document.execCommand("copy");
      if (copied) selection.removeAllRanges();
    }
    button.textContent = copied ? "Copied" : "Press Ctrl+C";
    setTimeout(() => { button.textContent = "Copy"; }, 2000);
  });
}
